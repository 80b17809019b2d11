// core/image/image.h: a picture of named float channels, the form in which every pass and file meets.
//
// Linear Rec. 709; radiance in cd/m^2. Row 0 is the top row. Channel names are those of the EXR: the beauty
// is R, G, B, A; everything else is `Layer.X`.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <glm/glm.hpp>

namespace core {

/// One named plane of width x height floats, row-major.
struct Channel {
    std::string name;
    std::vector<float> values;
};

/// A set of equally sized channels. Not thread-safe for adding channels; distinct pixels may be written from
/// distinct threads.
class Image {
public:
    Image() = default;
    Image(int width, int height) : width_(width), height_(height) {}

    int width() const { return width_; }
    int height() const { return height_; }
    std::size_t pixel_count() const {
        return static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
    }
    const std::vector<Channel>& channels() const { return channels_; }

    /// Adds a channel filled with `fill` and returns its values. The reference is valid until the next add.
    /// @pre no channel of that name exists.
    std::vector<float>& add_channel(std::string name, float fill = 0.0f);

    /// Takes over a plane. @pre values.size() == pixel_count() and no channel of that name exists.
    void add_channel(std::string name, std::vector<float> values);

    /// Adds `layer`.R, .G, .B (or R, G, B for an empty layer) from one array of colours.
    /// @pre colors.size() == pixel_count()
    void add_color(std::string_view layer, const std::vector<glm::vec3>& colors);

    /// Adds `layer`.X, .Y, .Z. @pre vectors.size() == pixel_count()
    void add_vector(std::string_view layer, const std::vector<glm::vec3>& vectors);

    /// The values of a channel, or nullptr where there is none.
    const std::vector<float>* find(std::string_view name) const;
    std::vector<float>* find(std::string_view name);

    /// The colour planes of a layer joined to vectors ("" is the beauty), or nothing where one is missing.
    std::optional<std::vector<glm::vec3>> color(std::string_view layer = "") const;

private:
    int width_ = 0;
    int height_ = 0;
    std::vector<Channel> channels_;
};

/// Values that are NaN or infinite, over all channels.
std::size_t count_nonfinite(const Image& image);

/// Rec. 709 luminance of a linear colour.
inline float luminance(const glm::vec3& color) {
    return 0.2126f * color.r + 0.7152f * color.g + 0.0722f * color.b;
}

}  // namespace core
