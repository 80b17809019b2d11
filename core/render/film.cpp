#include "core/render/film.h"

#include <algorithm>

namespace core {

namespace {

bool needs_auxiliary(const std::set<std::string>& layers) {
    return std::any_of(layers.begin(), layers.end(),
                       [](const std::string& layer) { return layer != "Variance"; });
}

}  // namespace

std::uint64_t Film::bytes(int width, int height, int batch_count, const std::set<std::string>& layers) {
    // Beauty, alpha and the mean they are developed from; a layer is a colour at most.
    const std::uint64_t developed = sizeof(float) * (7 + 3 * layers.size());
    const std::uint64_t summed = sizeof(glm::vec3) * static_cast<std::uint64_t>(batch_count) +
                                 sizeof(std::uint32_t) + (needs_auxiliary(layers) ? sizeof(Auxiliary) : 0);
    return static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) * (developed + summed);
}

Film::Film(int width, int height, int batch_count, const std::set<std::string>& layers)
    : width_(width), height_(height), batch_count_(batch_count), layers_(layers) {
    const std::size_t pixel_count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    auxiliary_ = needs_auxiliary(layers);
    radiance_.resize(pixel_count * static_cast<std::size_t>(batch_count), glm::vec3(0.0f));
    hit_count_.resize(pixel_count, 0);
    if (auxiliary_) sums_.resize(pixel_count);
}

void Film::add(std::size_t pixel, int batch, const FilmSample& sample) {
    radiance_[pixel * static_cast<std::size_t>(batch_count_) + static_cast<std::size_t>(batch)] +=
        sample.radiance;
    if (sample.hit) ++hit_count_[pixel];
    if (!auxiliary_) return;
    Auxiliary& sum = sums_[pixel];
    sum.direct += sample.direct;
    sum.indirect_diffuse += sample.indirect_diffuse;
    sum.steps += sample.steps;
    if (!sample.hit) return;
    sum.normal += sample.normal;
    sum.albedo += sample.albedo;
    sum.depth += sample.depth;
    sum.distance += sample.distance;
}

Image Film::develop(int sample_count) const {
    Image image(width_, height_);
    const float scale = 1.0f / static_cast<float>(sample_count);
    std::vector<glm::vec3> mean(hit_count_.size());
    std::vector<float> alpha(hit_count_.size());
    for (std::size_t pixel = 0; pixel < mean.size(); ++pixel) {
        glm::vec3 sum(0.0f);
        for (int batch = 0; batch < batch_count_; ++batch) {
            sum +=
                radiance_[pixel * static_cast<std::size_t>(batch_count_) + static_cast<std::size_t>(batch)];
        }
        mean[pixel] = sum * scale;
        alpha[pixel] = static_cast<float>(hit_count_[pixel]) * scale;
    }
    image.add_color("", mean);
    image.add_channel("A", std::move(alpha));
    if (wants("Variance")) develop_variance(mean, sample_count, image);
    if (auxiliary_) develop_auxiliary(mean, sample_count, image);
    return image;
}

void Film::develop_variance(const std::vector<glm::vec3>& mean, int sample_count, Image& image) const {
    std::vector<glm::vec3> variance(mean.size());
    const int live_batches = std::min(batch_count_, sample_count);
    for (std::size_t pixel = 0; pixel < mean.size(); ++pixel) {
        glm::dvec3 sum(0.0);
        for (int batch = 0; batch < live_batches; ++batch) {
            // Samples are dealt in turn, so the first batches may hold one more.
            const int count = (sample_count - batch + batch_count_ - 1) / batch_count_;
            const glm::dvec3 total(
                radiance_[pixel * static_cast<std::size_t>(batch_count_) + static_cast<std::size_t>(batch)]);
            const glm::dvec3 deviation = total / static_cast<double>(count) - glm::dvec3(mean[pixel]);
            sum += static_cast<double>(count) * deviation * deviation;
        }
        variance[pixel] =
            glm::vec3(sum / (static_cast<double>(live_batches - 1) * static_cast<double>(sample_count)));
    }
    image.add_color("Variance", variance);
}

void Film::develop_auxiliary(const std::vector<glm::vec3>& mean, int sample_count, Image& image) const {
    const std::size_t pixel_count = mean.size();
    const float scale = 1.0f / static_cast<float>(sample_count);
    std::vector<glm::vec3> colors(pixel_count);
    std::vector<float> values(pixel_count);
    const auto over_hits = [&](std::size_t pixel) {
        return hit_count_[pixel] > 0 ? 1.0f / static_cast<float>(hit_count_[pixel]) : 0.0f;
    };
    const auto add_color = [&](const char* layer, auto&& value_of) {
        if (!wants(layer)) return;
        for (std::size_t pixel = 0; pixel < pixel_count; ++pixel) colors[pixel] = value_of(pixel);
        image.add_color(layer, colors);
    };
    const auto add_value = [&](const char* layer, const char* channel, auto&& value_of) {
        if (!wants(layer)) return;
        for (std::size_t pixel = 0; pixel < pixel_count; ++pixel) values[pixel] = value_of(pixel);
        image.add_channel(channel, values);
    };
    add_value("Depth", "Depth.Z", [&](std::size_t p) { return sums_[p].depth * over_hits(p); });
    add_value("HitDistance", "HitDistance.Z",
              [&](std::size_t p) { return sums_[p].distance * over_hits(p); });
    add_value("Steps", "Steps.Y", [&](std::size_t p) { return sums_[p].steps * scale; });
    if (wants("Normal")) {
        for (std::size_t pixel = 0; pixel < pixel_count; ++pixel) {
            const float length = glm::length(sums_[pixel].normal);
            colors[pixel] = length > 0.0f ? sums_[pixel].normal / length : glm::vec3(0.0f);
        }
        image.add_vector("Normal", colors);
    }
    add_color("Albedo", [&](std::size_t p) { return sums_[p].albedo * over_hits(p); });
    add_color("Direct", [&](std::size_t p) { return sums_[p].direct * scale; });
    add_color("IndirectDiffuse", [&](std::size_t p) { return sums_[p].indirect_diffuse * scale; });
    // What is neither, so that the three add up to the beauty whatever the rounding.
    add_color("IndirectSpecular", [&](std::size_t p) {
        return glm::max(glm::vec3(0.0f), mean[p] - (sums_[p].direct + sums_[p].indirect_diffuse) * scale);
    });
}

}  // namespace core
