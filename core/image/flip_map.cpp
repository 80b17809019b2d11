#include "core/image/flip_map.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>

#include "core/support/parallel.h"

namespace core {

namespace {

constexpr std::size_t kRowsAtOnce = 8;

/// Rows give X, Y, Z of linear sRGB.
constexpr double kXyzFromRgb[3][3] = {
    {10135552.0 / 24577794.0, 8788810.0 / 24577794.0, 4435075.0 / 24577794.0},
    {2613072.0 / 12288897.0, 8788810.0 / 12288897.0, 887015.0 / 12288897.0},
    {1425312.0 / 73733382.0, 8788810.0 / 73733382.0, 70074185.0 / 73733382.0}};

/// XYZ over the white point (R = G = B = 1), so that white is (1, 1, 1).
glm::dmat3 relative_xyz_from_rgb() {
    glm::dmat3 matrix;
    for (int row = 0; row < 3; ++row) {
        const double white = kXyzFromRgb[row][0] + kXyzFromRgb[row][1] + kXyzFromRgb[row][2];
        for (int column = 0; column < 3; ++column) matrix[column][row] = kXyzFromRgb[row][column] / white;
    }
    return matrix;
}

/// Y, Cx, Cz: linear in XYZ, but for an offset.
glm::vec3 opponent_from_relative_xyz(const glm::vec3& xyz) {
    return {116.0f * xyz.y - 16.0f, 500.0f * (xyz.x - xyz.y), 200.0f * (xyz.y - xyz.z)};
}

glm::vec3 relative_xyz_from_opponent(const glm::vec3& opponent) {
    const float y = (opponent.x + 16.0f) / 116.0f;
    return {y + opponent.y / 500.0f, y, y - opponent.z / 200.0f};
}

float lab_curve(float t) {
    constexpr float kDelta = 6.0f / 29.0f;
    return t > kDelta * kDelta * kDelta ? std::cbrt(t) : t / (3.0f * kDelta * kDelta) + 4.0f / 29.0f;
}

/// CIELab whose chroma fades with lightness (Hunt: colourfulness grows with luminance).
glm::vec3 hunt_lab_from_relative_xyz(const glm::vec3& xyz) {
    const float x = lab_curve(xyz.x), y = lab_curve(xyz.y), z = lab_curve(xyz.z);
    const float lightness = 116.0f * y - 16.0f;
    return {lightness, 0.01f * lightness * 500.0f * (x - y), 0.01f * lightness * 200.0f * (y - z)};
}

/// HyAB distance, compressed.
float color_distance(const glm::vec3& a, const glm::vec3& b) {
    const glm::vec3 difference = a - b;
    const float chroma = std::sqrt(difference.y * difference.y + difference.z * difference.z);
    return std::pow(std::abs(difference.x) + chroma, 0.7f);
}

/// Colour spaces and the largest distance of colours on the screen, green to blue.
struct ColorScale {
    glm::mat3 xyz_from_rgb{relative_xyz_from_rgb()};
    glm::mat3 rgb_from_xyz{glm::inverse(relative_xyz_from_rgb())};
    float max_distance = color_distance(hunt_lab_from_relative_xyz(xyz_from_rgb[1]),
                                        hunt_lab_from_relative_xyz(xyz_from_rgb[2]));

    glm::vec3 opponent(const glm::vec3& rgb) const { return opponent_from_relative_xyz(xyz_from_rgb * rgb); }

    /// Filtered colours can leave the screen's gamut.
    glm::vec3 hunt_lab(const glm::vec3& opponent_color) const {
        const glm::vec3 rgb = rgb_from_xyz * relative_xyz_from_opponent(opponent_color);
        return hunt_lab_from_relative_xyz(xyz_from_rgb * glm::clamp(rgb, glm::vec3(0.0f), glm::vec3(1.0f)));
    }

    /// Into [0, 1]: small distances take up most of the range.
    float color_error(float distance) const {
        constexpr float kKneeShare = 0.4f, kKneeError = 0.95f;
        const float knee = kKneeShare * max_distance;
        if (distance < knee) return kKneeError * distance / knee;
        return kKneeError + (1.0f - kKneeError) * (distance - knee) / (max_distance - knee);
    }
};

const ColorScale& color_scale() {
    static const ColorScale scale;
    return scale;
}

/// A Gaussian over offsets, with what it summed to before it was normalised.
struct NormalizedGaussian {
    FlipKernel kernel;
    double sum = 0.0;
};

/// exp(-pi^2 d^2 / b), d in degrees. Weights too small to change a float are left out.
NormalizedGaussian contrast_gaussian(double b, int radius, double pixels_per_degree) {
    constexpr double kSmallest = 1e-9;
    std::vector<double> half;
    for (int offset = 0; offset <= radius; ++offset) {
        const double degrees = offset / pixels_per_degree;
        const double weight = std::exp(-std::numbers::pi * std::numbers::pi * degrees * degrees / b);
        if (weight < kSmallest) break;
        half.push_back(weight);
    }
    NormalizedGaussian gaussian;
    for (std::size_t i = 0; i < half.size(); ++i) gaussian.sum += i == 0 ? half[i] : 2.0 * half[i];
    const int reach = static_cast<int>(half.size()) - 1;
    for (int offset = -reach; offset <= reach; ++offset) {
        gaussian.kernel.weights.push_back(
            static_cast<float>(half[static_cast<std::size_t>(std::abs(offset))] / gaussian.sum));
    }
    return gaussian;
}

/// Positive weights scaled to sum to 1, negative ones to -1.
FlipKernel balanced(const std::vector<double>& weights) {
    double positive = 0.0, negative = 0.0;
    for (const double weight : weights) (weight > 0.0 ? positive : negative) += std::abs(weight);
    FlipKernel kernel;
    for (const double weight : weights) {
        kernel.weights.push_back(static_cast<float>(weight > 0.0   ? weight / positive
                                                    : weight < 0.0 ? weight / negative
                                                                   : 0.0));
    }
    return kernel;
}

/// Adds weight x source to row.
void add_scaled(const float* source, float weight, std::vector<float>& row) {
    float* const out = row.data();
    const std::size_t count = row.size();
    for (std::size_t x = 0; x < count; ++x) out[x] += weight * source[x];
}

/// A row with the outermost values repeated `padding` times on both sides.
class PaddedRow {
public:
    PaddedRow(int width, int padding)
        : width_(static_cast<std::size_t>(width)),
          padding_(static_cast<std::size_t>(padding)),
          values_(width_ + 2 * padding_),
          sum_(width_) {}

    float& operator[](std::size_t x) { return values_[padding_ + x]; }

    void replicate_borders() {
        const auto first = values_.begin() + static_cast<std::ptrdiff_t>(padding_);
        const auto last = first + static_cast<std::ptrdiff_t>(width_) - 1;
        std::fill(values_.begin(), first, *first);
        std::fill(last + 1, values_.end(), *last);
    }

    /// Writes row y of a plane of the same width.
    void filter(const FlipKernel& kernel, std::size_t y, std::vector<float>& plane) {
        std::fill(sum_.begin(), sum_.end(), 0.0f);
        const float* source = values_.data() + padding_ - static_cast<std::size_t>(kernel.radius());
        for (const float weight : kernel.weights) add_scaled(source++, weight, sum_);
        std::copy(sum_.begin(), sum_.end(), plane.begin() + static_cast<std::ptrdiff_t>(y * width_));
    }

private:
    std::size_t width_, padding_;
    std::vector<float> values_, sum_;
};

}  // namespace

FlipFilters::FlipFilters(double pixels_per_degree) {
    assert(pixels_per_degree >= 1.0);
    // a and b of a sum of a sqrt(pi / b) exp(-pi^2 d^2 / b), fitted to measured sensitivity.
    struct Gaussian {
        double a, b;
    };
    constexpr Gaussian kAchromatic{1.0, 0.0047}, kRedGreen{1.0, 0.0053},
        kBlueYellow[2] = {{34.1, 0.04}, {13.5, 0.025}};
    constexpr double kWidest = 0.04;
    const int radius = static_cast<int>(std::ceil(
        3.0 * std::sqrt(kWidest / (2.0 * std::numbers::pi * std::numbers::pi)) * pixels_per_degree));
    achromatic = contrast_gaussian(kAchromatic.b, radius, pixels_per_degree).kernel;
    red_green = contrast_gaussian(kRedGreen.b, radius, pixels_per_degree).kernel;
    double volumes[2], volume = 0.0;
    for (int i = 0; i < 2; ++i) {
        NormalizedGaussian gaussian = contrast_gaussian(kBlueYellow[i].b, radius, pixels_per_degree);
        blue_yellow[i] = std::move(gaussian.kernel);
        // The kernel of the picture is the product of two rows.
        volumes[i] =
            kBlueYellow[i].a * std::sqrt(std::numbers::pi / kBlueYellow[i].b) * gaussian.sum * gaussian.sum;
        volume += volumes[i];
    }
    for (int i = 0; i < 2; ++i) blue_yellow_weights[i] = static_cast<float>(volumes[i] / volume);

    constexpr double kFeatureWidthDegrees = 0.082;
    const double sigma = 0.5 * kFeatureWidthDegrees * pixels_per_degree;
    const int feature_radius = static_cast<int>(std::ceil(3.0 * sigma));
    std::vector<double> gaussian, first, second;
    for (int x = -feature_radius; x <= feature_radius; ++x) {
        const double weight = std::exp(-x * x / (2.0 * sigma * sigma));
        gaussian.push_back(weight);
        first.push_back(-x * weight);
        second.push_back((x * x / (sigma * sigma) - 1.0) * weight);
    }
    smooth = balanced(gaussian);
    edge = balanced(first);
    point = balanced(second);
}

/// One row of a picture, filtered both ways.
struct FlipMapper::FilteredRow {
    explicit FilteredRow(std::size_t width) {
        for (std::vector<float>* row : {&achromatic, &red_green, &blue_yellow[0], &blue_yellow[1], &edge_x,
                                        &edge_y, &point_x, &point_y}) {
            row->resize(width);
        }
    }

    std::vector<float> achromatic, red_green, blue_yellow[2], edge_x, edge_y, point_x, point_y;

    glm::vec3 opponent(std::size_t x, const float (&weights)[2]) const {
        return {achromatic[x], red_green[x], weights[0] * blue_yellow[0][x] + weights[1] * blue_yellow[1][x]};
    }
    float edge(std::size_t x) const { return std::sqrt(edge_x[x] * edge_x[x] + edge_y[x] * edge_y[x]); }
    float point(std::size_t x) const { return std::sqrt(point_x[x] * point_x[x] + point_y[x] * point_y[x]); }
};

FlipMapper::FlipMapper(int width, int height, double pixels_per_degree)
    : width_(width), height_(height), filters_(pixels_per_degree) {
    assert(width > 0 && height > 0);
    padding_ = std::max(filters_.smooth.radius(), filters_.blue_yellow[0].radius());
    for (Planes* planes : {&test_, &reference_}) {
        for (std::vector<float>* plane :
             {&planes->achromatic, &planes->red_green, &planes->blue_yellow[0], &planes->blue_yellow[1],
              &planes->smooth, &planes->edge, &planes->point}) {
            plane->resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
        }
    }
}

void FlipMapper::filter_rows(std::span<const glm::vec3> picture, Planes& planes) const {
    const auto width = static_cast<std::size_t>(width_);
    const ColorScale& scale = color_scale();
    parallel_for(static_cast<std::size_t>(height_), kRowsAtOnce, [&](std::size_t begin, std::size_t end) {
        PaddedRow lightness(width_, padding_), red_green(width_, padding_), blue_yellow(width_, padding_),
            luminance(width_, padding_);
        for (std::size_t y = begin; y < end; ++y) {
            for (std::size_t x = 0; x < width; ++x) {
                const glm::vec3 opponent = scale.opponent(picture[y * width + x]);
                lightness[x] = opponent.x;
                red_green[x] = opponent.y;
                blue_yellow[x] = opponent.z;
                luminance[x] = (opponent.x + 16.0f) / 116.0f;
            }
            for (PaddedRow* row : {&lightness, &red_green, &blue_yellow, &luminance}) {
                row->replicate_borders();
            }
            lightness.filter(filters_.achromatic, y, planes.achromatic);
            red_green.filter(filters_.red_green, y, planes.red_green);
            blue_yellow.filter(filters_.blue_yellow[0], y, planes.blue_yellow[0]);
            blue_yellow.filter(filters_.blue_yellow[1], y, planes.blue_yellow[1]);
            luminance.filter(filters_.smooth, y, planes.smooth);
            luminance.filter(filters_.edge, y, planes.edge);
            luminance.filter(filters_.point, y, planes.point);
        }
    });
}

void FlipMapper::filter_column(const std::vector<float>& plane, const FlipKernel& kernel, int y,
                               std::vector<float>& row) const {
    std::fill(row.begin(), row.end(), 0.0f);
    int source_y = y - kernel.radius();
    for (const float weight : kernel.weights) {
        const auto clamped = static_cast<std::size_t>(std::clamp(source_y++, 0, height_ - 1));
        add_scaled(plane.data() + clamped * static_cast<std::size_t>(width_), weight, row);
    }
}

void FlipMapper::filter_columns(const Planes& planes, int y, FilteredRow& row) const {
    filter_column(planes.achromatic, filters_.achromatic, y, row.achromatic);
    filter_column(planes.red_green, filters_.red_green, y, row.red_green);
    filter_column(planes.blue_yellow[0], filters_.blue_yellow[0], y, row.blue_yellow[0]);
    filter_column(planes.blue_yellow[1], filters_.blue_yellow[1], y, row.blue_yellow[1]);
    filter_column(planes.edge, filters_.smooth, y, row.edge_x);
    filter_column(planes.smooth, filters_.edge, y, row.edge_y);
    filter_column(planes.point, filters_.smooth, y, row.point_x);
    filter_column(planes.smooth, filters_.point, y, row.point_y);
}

void FlipMapper::raise(std::span<const glm::vec3> test, std::span<const glm::vec3> reference,
                       std::span<float> map) {
    const auto width = static_cast<std::size_t>(width_);
    assert(test.size() == width * static_cast<std::size_t>(height_));
    assert(reference.size() == test.size() && map.size() == test.size());
    filter_rows(test, test_);
    filter_rows(reference, reference_);
    const ColorScale& scale = color_scale();
    parallel_for(static_cast<std::size_t>(height_), kRowsAtOnce, [&](std::size_t begin, std::size_t end) {
        FilteredRow test_row(width), reference_row(width);
        for (std::size_t y = begin; y < end; ++y) {
            filter_columns(test_, static_cast<int>(y), test_row);
            filter_columns(reference_, static_cast<int>(y), reference_row);
            for (std::size_t x = 0; x < width; ++x) {
                const float color = scale.color_error(
                    color_distance(scale.hunt_lab(reference_row.opponent(x, filters_.blue_yellow_weights)),
                                   scale.hunt_lab(test_row.opponent(x, filters_.blue_yellow_weights))));
                const float feature = std::max(std::abs(reference_row.edge(x) - test_row.edge(x)),
                                               std::abs(reference_row.point(x) - test_row.point(x)));
                const float feature_error = std::sqrt(std::min(feature / std::numbers::sqrt2_v<float>, 1.0f));
                float& error = map[y * width + x];
                error = std::max(error, std::pow(color, 1.0f - feature_error));
            }
        }
    });
}

}  // namespace core
