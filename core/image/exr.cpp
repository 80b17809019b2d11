#include "core/image/exr.h"

#include <ImfBoxAttribute.h>
#include <ImfChannelList.h>
#include <ImfChromaticitiesAttribute.h>
#include <ImfDoubleAttribute.h>
#include <ImfEnvmapAttribute.h>
#include <ImfFloatAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfIntAttribute.h>
#include <ImfLineOrderAttribute.h>
#include <ImfMatrixAttribute.h>
#include <ImfOutputFile.h>
#include <ImfRationalAttribute.h>
#include <ImfRgbaFile.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <ImfStringVectorAttribute.h>
#include <ImfVecAttribute.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <new>
#include <span>

#include "core/image/exr_scan.h"
#include "core/support/atomic_file.h"
#include "core/support/error.h"
#include "core/support/file_bytes.h"
#include "core/support/memory.h"

namespace core {

namespace fs = std::filesystem;

namespace {

constexpr std::uint64_t kMaxFileBytes = std::uint64_t{1} << 32;

/// A file that is written in memory: OpenEXR's own streams swallow a full disk when they close.
class MemoryOutput : public Imf::OStream {
public:
    explicit MemoryOutput(const char* name) : Imf::OStream(name) {}

    void write(const char source[], int count) override {
        const auto size = static_cast<std::size_t>(count);
        if (position_ + size > bytes_.size()) bytes_.resize(position_ + size);
        std::memcpy(bytes_.data() + position_, source, size);
        position_ += size;
    }
    std::uint64_t tellp() override { return position_; }
    void seekp(std::uint64_t position) override { position_ = position; }

    const std::string& bytes() const { return bytes_; }

private:
    std::string bytes_;
    std::size_t position_ = 0;
};

/// A file that was read and scanned before OpenEXR sees it.
class MemoryInput : public Imf::IStream {
public:
    MemoryInput(const char* name, std::span<const std::uint8_t> bytes) : Imf::IStream(name), bytes_(bytes) {}

    bool read(char target[], int count) override {
        const auto size = static_cast<std::size_t>(count);
        if (count < 0 || position_ > bytes_.size() || size > bytes_.size() - position_) {
            throw std::runtime_error("the file ends early");
        }
        std::memcpy(target, bytes_.data() + position_, size);
        position_ += size;
        return position_ < bytes_.size();
    }
    std::uint64_t tellg() override { return position_; }
    void seekg(std::uint64_t position) override { position_ = position; }

private:
    std::span<const std::uint8_t> bytes_;
    std::size_t position_ = 0;
};

bool is_color_channel(const std::string& name) {
    const std::size_t dot = name.rfind('.');
    const std::string component = dot == std::string::npos ? name : name.substr(dot + 1);
    const std::string layer = dot == std::string::npos ? "" : name.substr(0, dot);
    return layer != "Variance" && component.size() == 1 && std::strchr("RGBA", component[0]) != nullptr;
}

std::vector<half> to_half(const std::vector<float>& values, std::size_t& saturated) {
    std::vector<half> result(values.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
        float value = values[i];
        if (std::isfinite(value) && std::abs(value) > kMaxHalf) {
            value = std::copysign(kMaxHalf, value);
            ++saturated;
        }
        result[i] = half(value);
    }
    return result;
}

void insert_attributes(Imf::Header& header, const ExrAttributes& attributes) {
    for (const auto& [name, value] : attributes) {
        assert(name != "chromaticities");
        if (const auto* text = std::get_if<std::string>(&value)) {
            header.insert(name, Imf::StringAttribute(*text));
        } else if (const auto* number = std::get_if<float>(&value)) {
            header.insert(name, Imf::FloatAttribute(*number));
        } else if (const auto* integer = std::get_if<int>(&value)) {
            header.insert(name, Imf::IntAttribute(*integer));
        } else {
            // GLM's columns are OpenEXR's rows: a transpose on top of column-major storage is a plain copy.
            const glm::mat4& matrix = std::get<glm::mat4>(value);
            Imath::M44f rows;
            for (int i = 0; i < 4; ++i) {
                for (int j = 0; j < 4; ++j) rows[i][j] = matrix[i][j];
            }
            header.insert(name, Imf::M44fAttribute(rows));
        }
    }
}

const char* compression_name(Imf::Compression compression) {
    constexpr const char* kNames[] = {"none",  "rle", "zips", "zip",  "piz",
                                      "pxr24", "b44", "b44a", "dwaa", "dwab"};
    return kNames[compression];
}

const char* pixel_type_name(Imf::PixelType type) {
    return type == Imf::HALF ? "half" : type == Imf::FLOAT ? "float" : "uint";
}

template <typename T>
const T* value_of(const Imf::Attribute& attribute) {
    const auto* typed = dynamic_cast<const Imf::TypedAttribute<T>*>(&attribute);
    return typed ? &typed->value() : nullptr;
}

template <typename Matrix>
std::string matrix_text(const Matrix& matrix, int size) {
    std::vector<float> values;
    for (int i = 0; i < size * size; ++i) values.push_back(matrix[i / size][i % size]);
    return fmt::format("{}", fmt::join(values, " "));
}

std::string attribute_text(const Imf::Attribute& attribute) {
    if (const auto* text = value_of<std::string>(attribute)) return *text;
    if (const auto* integer = value_of<int>(attribute)) return fmt::format("{}", *integer);
    if (const auto* number = value_of<float>(attribute)) return fmt::format("{}", *number);
    if (const auto* number = value_of<double>(attribute)) return fmt::format("{}", *number);
    if (const auto* m = value_of<Imath::M44f>(attribute)) return matrix_text(*m, 4);
    if (const auto* m = value_of<Imath::M33f>(attribute)) return matrix_text(*m, 3);
    if (const auto* v = value_of<Imath::V2f>(attribute)) return fmt::format("{} {}", v->x, v->y);
    if (const auto* v = value_of<Imath::V3f>(attribute)) return fmt::format("{} {} {}", v->x, v->y, v->z);
    if (const auto* v = value_of<Imath::V2i>(attribute)) return fmt::format("{} {}", v->x, v->y);
    if (const auto* v = value_of<Imath::V3i>(attribute)) return fmt::format("{} {} {}", v->x, v->y, v->z);
    if (const auto* box = value_of<Imath::Box2i>(attribute)) {
        return fmt::format("{} {} {} {}", box->min.x, box->min.y, box->max.x, box->max.y);
    }
    if (const auto* box = value_of<Imath::Box2f>(attribute)) {
        return fmt::format("{} {} {} {}", box->min.x, box->min.y, box->max.x, box->max.y);
    }
    if (const auto* ratio = value_of<Imf::Rational>(attribute))
        return fmt::format("{}/{}", ratio->n, ratio->d);
    if (const auto* c = value_of<Imf::Chromaticities>(attribute)) {
        return fmt::format("red {} {}, green {} {}, blue {} {}, white {} {}", c->red.x, c->red.y, c->green.x,
                           c->green.y, c->blue.x, c->blue.y, c->white.x, c->white.y);
    }
    if (const auto* list = value_of<Imf::StringVector>(attribute))
        return fmt::format("{}", fmt::join(*list, ", "));
    if (const auto* order = value_of<Imf::LineOrder>(attribute)) {
        return *order == Imf::INCREASING_Y   ? "increasing y"
               : *order == Imf::DECREASING_Y ? "decreasing y"
                                             : "random";
    }
    if (const auto* map = value_of<Imf::Envmap>(attribute)) {
        return *map == Imf::ENVMAP_LATLONG ? "latitude-longitude" : "cube";
    }
    return fmt::format("({})", attribute.typeName());
}

ExrWindow window_of(const Imath::Box2i& box) {
    return {box.min.x, box.min.y, box.max.x, box.max.y};
}

ExrInfo info_of(const Imf::Header& header) {
    ExrInfo info;
    info.data_window = window_of(header.dataWindow());
    info.display_window = window_of(header.displayWindow());
    info.width = info.data_window.max_x - info.data_window.min_x + 1;
    info.height = info.data_window.max_y - info.data_window.min_y + 1;
    info.compression = compression_name(header.compression());
    info.tiled = header.hasTileDescription();
    const Imf::ChannelList& channels = header.channels();
    for (auto channel = channels.begin(); channel != channels.end(); ++channel) {
        info.channels.push_back({channel.name(), pixel_type_name(channel.channel().type),
                                 channel.channel().xSampling, channel.channel().ySampling});
    }
    for (auto attribute = header.begin(); attribute != header.end(); ++attribute) {
        const std::string name = attribute.name();
        if (name == "channels" || name == "dataWindow" || name == "displayWindow" || name == "compression" ||
            name == "tiles") {
            continue;
        }
        info.attributes[name] = attribute_text(attribute.attribute());
    }
    return info;
}

bool is_luminance_chroma(const ExrInfo& info) {
    const auto has = [&](const char* name) {
        return std::any_of(info.channels.begin(), info.channels.end(),
                           [name](const ExrChannelInfo& channel) { return channel.name == name; });
    };
    return has("Y") && has("RY") && has("BY");
}

/// R, G, B, A in front, the rest as the file has it.
std::vector<std::string> reading_order(const ExrInfo& info) {
    std::vector<std::string> names;
    for (const ExrChannelInfo& channel : info.channels) names.push_back(channel.name);
    const auto rank = [](const std::string& name) {
        const std::size_t found =
            name.size() == 1 ? std::string_view("RGBA").find(name[0]) : std::string::npos;
        return std::min<std::size_t>(found, 4);
    };
    std::stable_sort(names.begin(), names.end(),
                     [&](const std::string& a, const std::string& b) { return rank(a) < rank(b); });
    return names;
}

Image read_planes(Imf::InputFile& file, const ExrInfo& info, const std::string& name) {
    for (const ExrChannelInfo& channel : info.channels) {
        if (channel.x_sampling == 1 && channel.y_sampling == 1) continue;
        throw InputError(
            ErrorKind::kBadData,
            fmt::format("'{}': channel '{}' has one sample every {} x {} pixels; only channels with "
                        "all pixels, or Y with RY and BY, can be read",
                        name, channel.name, channel.x_sampling, channel.y_sampling));
    }
    const std::vector<std::string> names = reading_order(info);
    std::vector<std::vector<float>> planes(names.size());
    Imf::FrameBuffer frame_buffer;
    const auto width = static_cast<std::size_t>(info.width), height = static_cast<std::size_t>(info.height);
    require_memory(sizeof(float) * width * height * names.size(),
                   fmt::format("'{}': {} x {} pixels of {} channels", name, width, height, names.size()));
    for (std::size_t i = 0; i < names.size(); ++i) {
        planes[i].resize(width * height);
        frame_buffer.insert(
            names[i], Imf::Slice::Make(Imf::FLOAT, planes[i].data(),
                                       Imath::V2i(info.data_window.min_x, info.data_window.min_y), info.width,
                                       info.height, sizeof(float), width * sizeof(float)));
    }
    file.setFrameBuffer(frame_buffer);
    file.readPixels(info.data_window.min_y, info.data_window.max_y);
    Image image(info.width, info.height);
    for (std::size_t i = 0; i < names.size(); ++i) image.add_channel(names[i], std::move(planes[i]));
    return image;
}

Image read_luminance_chroma(Imf::IStream& stream, const ExrInfo& info, const std::string& name) {
    for (const ExrChannelInfo& channel : info.channels) {
        if (channel.name == "Y" || channel.name == "RY" || channel.name == "BY" || channel.name == "A")
            continue;
        throw InputError(
            ErrorKind::kBadData,
            fmt::format("'{}': channel '{}' stands beside luminance and chroma; only Y, RY, BY and A "
                        "can be read together",
                        name, channel.name));
    }
    const auto width = static_cast<std::size_t>(info.width), height = static_cast<std::size_t>(info.height);
    require_memory((sizeof(Imf::Rgba) + 4 * sizeof(float)) * width * height,
                   fmt::format("'{}': {} x {} pixels", name, width, height));
    std::vector<Imf::Rgba> pixels(width * height);
    stream.seekg(0);
    Imf::RgbaInputFile file(stream);
    // The frame buffer's origin is pixel (0, 0), which may lie outside the data window.
    const std::ptrdiff_t origin = static_cast<std::ptrdiff_t>(info.data_window.min_x) +
                                  static_cast<std::ptrdiff_t>(info.data_window.min_y) * info.width;
    file.setFrameBuffer(pixels.data() - origin, 1, width);
    file.readPixels(info.data_window.min_y, info.data_window.max_y);
    Image image(info.width, info.height);
    const bool has_alpha = std::any_of(info.channels.begin(), info.channels.end(),
                                       [](const ExrChannelInfo& channel) { return channel.name == "A"; });
    half Imf::Rgba::*const components[] = {&Imf::Rgba::r, &Imf::Rgba::g, &Imf::Rgba::b, &Imf::Rgba::a};
    for (int i = 0; i < (has_alpha ? 4 : 3); ++i) {
        std::vector<float>& plane = image.add_channel(std::string(1, "RGBA"[i]));
        for (std::size_t pixel = 0; pixel < pixels.size(); ++pixel)
            plane[pixel] = pixels[pixel].*components[i];
    }
    return image;
}

/// Scans a file and hands it to `use`, with every exception of OpenEXR turned into ours.
template <typename Use>
auto with_open_file(const fs::path& path, const Use& use) {
    const std::string name = path.string();
    const std::vector<std::uint8_t> bytes = read_file_bytes(path, kMaxFileBytes);
    scan_exr_header(bytes, name);
    try {
        MemoryInput stream(name.c_str(), bytes);
        Imf::InputFile file(stream);
        return use(stream, file, name);
    } catch (const InputError&) {
        throw;
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& error) {
        throw InputError(ErrorKind::kBadData,
                         fmt::format("'{}': is damaged or not supported by OpenEXR: {}", name, error.what()));
    }
}

}  // namespace

std::size_t write_exr(const fs::path& path, const Image& image, const ExrAttributes& attributes,
                      bool half_colors) {
    assert(image.pixel_count() > 0 && !image.channels().empty());
    Imf::Header header(image.width(), image.height());
    header.compression() = Imf::ZIP_COMPRESSION;
    Imf::addChromaticities(header, Imf::Chromaticities());  // Its default is Rec. 709.
    insert_attributes(header, attributes);

    std::size_t saturated = 0;
    const auto width = static_cast<std::size_t>(image.width());
    std::vector<std::vector<half>> half_planes;
    half_planes.reserve(image.channels().size());
    Imf::FrameBuffer frame_buffer;
    for (const Channel& channel : image.channels()) {
        if (half_colors && is_color_channel(channel.name)) {
            std::vector<half>& plane = half_planes.emplace_back(to_half(channel.values, saturated));
            header.channels().insert(channel.name, Imf::Channel(Imf::HALF));
            frame_buffer.insert(channel.name, Imf::Slice(Imf::HALF, reinterpret_cast<char*>(plane.data()),
                                                         sizeof(half), width * sizeof(half)));
        } else {
            header.channels().insert(channel.name, Imf::Channel(Imf::FLOAT));
            // OpenEXR reads through a pointer to non-const when it writes a file.
            char* values = reinterpret_cast<char*>(const_cast<float*>(channel.values.data()));
            frame_buffer.insert(channel.name,
                                Imf::Slice(Imf::FLOAT, values, sizeof(float), width * sizeof(float)));
        }
    }
    MemoryOutput stream(path.c_str());
    {
        Imf::OutputFile file(stream, header);
        file.setFrameBuffer(frame_buffer);
        file.writePixels(image.height());
    }
    write_text_atomically(path, stream.bytes());
    return saturated;
}

ExrInfo read_exr_info(const fs::path& path) {
    return with_open_file(
        path, [](Imf::IStream&, Imf::InputFile& file, const std::string&) { return info_of(file.header()); });
}

ExrFile read_exr_file(const fs::path& path) {
    return with_open_file(path, [](Imf::IStream& stream, Imf::InputFile& file, const std::string& name) {
        ExrFile result{info_of(file.header()), {}};
        result.image = is_luminance_chroma(result.info) ? read_luminance_chroma(stream, result.info, name)
                                                        : read_planes(file, result.info, name);
        return result;
    });
}

Image read_exr(const fs::path& path) {
    return read_exr_file(path).image;
}

}  // namespace core
