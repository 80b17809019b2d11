#include "cli/report_pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include "cli/report_encode.h"
#include "core/image/png.h"
#include "core/image/tonemap.h"

namespace cli {

namespace {

constexpr int kThumbnailWidth = 288;
constexpr std::size_t kThumbnailShare = 5;  // One part in so many of the budget.

std::string data_uri(int width, int height, std::span<const std::uint8_t> rgb) {
    return "data:image/png;base64," + base64(core::encode_png(width, height, rgb));
}

/// Means over the pixels that each smaller pixel covers. Values that are not finite spoil the mean, so that
/// they are seen.
template <typename Value>
std::vector<Value> reduced(const std::vector<Value>& values, int width, int height, int new_width,
                           int new_height) {
    assert(values.size() == static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    if (new_width == width && new_height == height) return values;
    std::vector<Value> result;
    const auto edge = [](int i, int size, int new_size) {
        return static_cast<int>(static_cast<long long>(i) * size / new_size);
    };
    for (int row = 0; row < new_height; ++row) {
        const int top = edge(row, height, new_height), bottom = edge(row + 1, height, new_height);
        for (int column = 0; column < new_width; ++column) {
            const int left = edge(column, width, new_width), right = edge(column + 1, width, new_width);
            Value sum(0.0f);
            for (int y = top; y < bottom; ++y)
                for (int x = left; x < right; ++x)
                    sum += values[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                  static_cast<std::size_t>(x)];
            result.push_back(sum / static_cast<float>((bottom - top) * (right - left)));
        }
    }
    return result;
}

class Encoder {
public:
    explicit Encoder(const Report& report) : report_(report) {
        std::vector<float> all_steps;
        for (const ReportPicture& picture : report.pictures)
            all_steps.insert(all_steps.end(), picture.steps.begin(), picture.steps.end());
        for (const float value : all_steps)
            if (std::isfinite(value)) largest_step_ = std::max(largest_step_, value);
        result_.steps = steps_scale(std::move(all_steps));
        result_.ev = core::automatic_exposure(report.pictures.front().radiance);
        result_.pictures.resize(report.pictures.size());
    }

    EncodedPictures encode(std::size_t budget) {
        int width = std::min(kThumbnailWidth, report_.width);
        while (make_thumbnails(width) > budget / kThumbnailShare && width > 1)
            width = std::max(1, width * 3 / 4);
        std::size_t used = thumbnail_bytes();
        std::vector<std::string> blocks(report_.pictures.size());
        // "false" becomes "true": the description only gets shorter.
        used += description().size();
        for (const std::size_t i : order()) {
            blocks[i] = values_of(i);
            if (used + blocks[i].size() > budget) {
                blocks[i].clear();
                continue;
            }
            used += blocks[i].size();
            result_.pictures[i].exact = true;
        }
        result_.data = description();
        for (const std::string& block : blocks) result_.data += block;
        return std::move(result_);
    }

private:
    /// Makes all thumbnails of that width and returns their bytes.
    std::size_t make_thumbnails(int width) {
        const int height = std::max(
            1, static_cast<int>(std::lround(static_cast<double>(report_.height) * width / report_.width)));
        result_.thumbnail_width = width;
        result_.thumbnail_height = height;
        for (std::size_t i = 0; i < report_.pictures.size(); ++i) {
            const ReportPicture& picture = report_.pictures[i];
            EncodedPicture& encoded = result_.pictures[i];
            const auto colors = reduced(picture.radiance, report_.width, report_.height, width, height);
            encoded.color =
                data_uri(width, height, core::display_picture(colors, result_.ev, core::ToneMap::kAces));
            const auto map = [&](const std::vector<float>& values, const HeatScale& scale) {
                if (values.empty()) return std::string();
                const auto small = reduced(values, report_.width, report_.height, width, height);
                return data_uri(width, height, heat_picture(small, scale));
            };
            encoded.flip = map(picture.flip, kFlipScale);
            encoded.error = map(picture.relative_error, kErrorScale);
            encoded.steps = map(picture.steps, result_.steps);
        }
        return thumbnail_bytes();
    }

    std::size_t thumbnail_bytes() const {
        std::size_t bytes = 0;
        for (const EncodedPicture& picture : result_.pictures)
            bytes += picture.color.size() + picture.flip.size() + picture.error.size() + picture.steps.size();
        return bytes;
    }

    const ReportSeries* series_of(const ReportPicture& picture) const {
        const auto found =
            std::find_if(report_.series.begin(), report_.series.end(),
                         [&](const ReportSeries& series) { return series.method == picture.name; });
        return found == report_.series.end() ? nullptr : &*found;
    }

    /// The pictures in the order in which they get their share of the page: the reference, triangles, then
    /// fields from the finest down.
    std::vector<std::size_t> order() const {
        std::vector<std::size_t> order(report_.pictures.size());
        std::iota(order.begin(), order.end(), std::size_t{0});
        const auto rank = [&](std::size_t i) {
            const ReportSeries* series = series_of(report_.pictures[i]);
            if (!series) return std::pair(i == 0 ? 0 : 3, 0);
            return series->tracer == "triangle" ? std::pair(1, 0) : std::pair(2, -series->resolution);
        };
        std::stable_sort(order.begin(), order.end(),
                         [&](std::size_t a, std::size_t b) { return rank(a) < rank(b); });
        return order;
    }

    std::string values_of(std::size_t i) const {
        const ReportPicture& picture = report_.pictures[i];
        const auto block = [&](std::string_view kind, const std::string& text) {
            return fmt::format("<script type=\"text/plain\" id=\"values-{}-{}\">{}</script>\n", i, kind,
                               text);
        };
        std::string html = block("radiance", encode_colors(picture.radiance));
        if (!picture.flip.empty()) html += block("flip", encode_map(picture.flip, 1.0f));
        if (!picture.steps.empty()) html += block("steps", encode_map(picture.steps, largest_step_));
        return html;
    }

    /// What the viewer must know, as JSON.
    std::string description() const {
        nlohmann::json pictures = nlohmann::json::array();
        for (std::size_t i = 0; i < report_.pictures.size(); ++i) {
            const ReportPicture& picture = report_.pictures[i];
            pictures.push_back({{"name", picture.name},
                                {"file", picture.exr},
                                {"exact", result_.pictures[i].exact},
                                {"flip", !picture.flip.empty()},
                                {"steps", !picture.steps.empty()}});
        }
        const auto thresholds = tone_thresholds();
        const std::string_view threshold_bytes(reinterpret_cast<const char*>(thresholds.data()),
                                               sizeof(thresholds));
        const nlohmann::json json = {{"width", report_.width},
                                     {"height", report_.height},
                                     {"ev", result_.ev},
                                     {"steps_unit", largest_step_ / 65534.0f},
                                     {"steps_high", result_.steps.high},
                                     {"error_low", kErrorScale.low},
                                     {"error_high", kErrorScale.high},
                                     {"tone_thresholds", base64(threshold_bytes)},
                                     {"magma", base64(color_table(HeatMap::kMagma))},
                                     {"viridis", base64(color_table(HeatMap::kViridis))},
                                     {"pictures", pictures}};
        std::string text = json.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
        // "</script>" in a name must not end the element.
        for (std::size_t at = text.find('<'); at != std::string::npos; at = text.find('<', at))
            text.replace(at, 1, "\\u003c");
        return "<script type=\"application/json\" id=\"viewer-data\">" + text + "</script>\n";
    }

    const Report& report_;
    EncodedPictures result_;
    float largest_step_ = 1.0f;
};

}  // namespace

EncodedPictures encode_pictures(const Report& report, std::size_t budget) {
    if (report.pictures.empty()) return {};
    return Encoder(report).encode(budget);
}

}  // namespace cli
