#include "core/trace/ray_stream.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <vector>

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

core::Ray good_ray() {
    return {{1.0f, 2.0f, 3.0f}, 0.5f, {0.0f, 0.6f, 0.8f}, 9.0f, 77u};
}

TEST(RayStream, ReturnsTheRaysThatWereSet) {
    core::RayStream stream;
    for (std::uint32_t i = 0; i < 40; ++i) {
        core::Ray ray = good_ray();
        ray.origin.x = float(i);
        ray.seed = i;
        stream.push_back(ray);
    }
    ASSERT_EQ(stream.size(), 40u);
    for (std::uint32_t i = 0; i < 40; ++i) {
        const core::Ray ray = stream.get(i);
        EXPECT_EQ(ray.origin, glm::vec3(float(i), 2.0f, 3.0f));
        EXPECT_EQ(ray.direction, good_ray().direction);
        EXPECT_EQ(ray.t_min, 0.5f);
        EXPECT_EQ(ray.t_max, 9.0f);
        EXPECT_EQ(ray.seed, i);
    }
}

TEST(RayStream, PadsEveryColumnToWholeAlignedVectorsOfInvalidRays) {
    for (const std::size_t size : {0, 1, 15, 16, 17, 33}) {
        core::RayStream stream;
        for (std::size_t i = 0; i < size; ++i) stream.push_back(good_ray());
        for (const core::Column<float>* column :
             {&stream.origin_x, &stream.origin_y, &stream.origin_z, &stream.t_min, &stream.direction_x,
              &stream.direction_y, &stream.direction_z, &stream.t_max}) {
            EXPECT_EQ(column->size() % core::kStreamLanes, 0u);
            EXPECT_GE(column->size(), size);
            if (size > 0) {
                EXPECT_EQ(reinterpret_cast<std::uintptr_t>(column->data()) % 64, 0u);
            }
        }
        for (std::size_t i = size; i < stream.t_max.size(); ++i) {
            EXPECT_FALSE(core::is_valid_ray(stream.get(i)));
        }
        for (std::size_t i = 0; i < size; ++i) EXPECT_TRUE(core::is_valid_ray(stream.get(i)));
    }
}

TEST(RayStream, ShrinkingAndGrowingLeavesNoOldRayBehind) {
    core::RayStream stream;
    for (int i = 0; i < 20; ++i) stream.push_back(good_ray());
    stream.resize(3);
    for (std::size_t i = 3; i < stream.t_max.size(); ++i) EXPECT_FALSE(core::is_valid_ray(stream.get(i)));
    stream.resize(10);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_TRUE(core::is_valid_ray(stream.get(i)));
    for (std::size_t i = 3; i < stream.t_max.size(); ++i) EXPECT_FALSE(core::is_valid_ray(stream.get(i)));
    stream.clear();
    EXPECT_TRUE(stream.empty());
}

TEST(HitStream, ReturnsTheHitsThatWereSet) {
    core::HitStream stream;
    stream.resize(18);
    core::Hit hit;
    hit.t = 2.5f;
    hit.normal = {0.0f, 1.0f, 0.0f};
    hit.instance = 4;
    hit.triangle = 5;
    hit.barycentrics = {0.25f, 0.5f};
    hit.front = false;
    hit.status = core::HitStatus::kExhausted;
    hit.steps = 6;
    hit.offset = 0.125f;
    stream.set(17, hit);
    const core::Hit back = stream.get(17);
    EXPECT_EQ(back.t, hit.t);
    EXPECT_EQ(back.normal, hit.normal);
    EXPECT_EQ(back.instance, hit.instance);
    EXPECT_EQ(back.triangle, hit.triangle);
    EXPECT_EQ(back.barycentrics, hit.barycentrics);
    EXPECT_EQ(back.front, hit.front);
    EXPECT_EQ(back.status, hit.status);
    EXPECT_EQ(back.steps, hit.steps);
    EXPECT_EQ(back.offset, hit.offset);
    EXPECT_FALSE(back.hit());
}

TEST(ValidRay, IsFiniteUnitAndOrdered) {
    EXPECT_TRUE(core::is_valid_ray(good_ray()));
    core::Ray ray = good_ray();
    ray.t_max = kInfinity;
    EXPECT_TRUE(core::is_valid_ray(ray));
    ray = good_ray();
    ray.t_min = ray.t_max;
    EXPECT_TRUE(core::is_valid_ray(ray));

    for (const float bad : {kNaN, kInfinity, -kInfinity}) {
        for (int axis = 0; axis < 3; ++axis) {
            ray = good_ray();
            ray.origin[axis] = bad;
            EXPECT_FALSE(core::is_valid_ray(ray)) << bad << " in origin " << axis;
            ray = good_ray();
            ray.direction[axis] = bad;
            EXPECT_FALSE(core::is_valid_ray(ray)) << bad << " in direction " << axis;
        }
        ray = good_ray();
        ray.t_min = bad;
        EXPECT_FALSE(core::is_valid_ray(ray)) << bad << " as t_min";
    }
    // Opposite infinities must not cancel.
    ray = good_ray();
    ray.origin = {kInfinity, -kInfinity, 0.0f};
    EXPECT_FALSE(core::is_valid_ray(ray));
    ray = good_ray();
    ray.t_max = kNaN;
    EXPECT_FALSE(core::is_valid_ray(ray));
    ray = good_ray();
    ray.t_min = 9.5f;
    EXPECT_FALSE(core::is_valid_ray(ray));
    for (const float length : {0.0f, 1e-30f, 0.99f, 1.01f, 1e30f}) {
        ray = good_ray();
        ray.direction *= length;
        EXPECT_FALSE(core::is_valid_ray(ray)) << "length " << length;
    }
}

TEST(RayStream, ManyRaysAreTestedAsOneIs) {
    core::RayStream stream;
    for (const float bad : {0.0f, -0.0f, 1.0f, 0.8f, 1e-40f, 3e38f, kInfinity, -kInfinity, kNaN}) {
        for (int component = 0; component < 8; ++component) {
            core::Ray ray = good_ray();
            float* parts[] = {&ray.origin.x,    &ray.origin.y,    &ray.origin.z,    &ray.t_min,
                              &ray.direction.x, &ray.direction.y, &ray.direction.z, &ray.t_max};
            *parts[component] = bad;
            stream.push_back(ray);
        }
    }
    std::vector<std::uint8_t> valid(stream.size() - 3);
    core::find_valid_rays(stream, 3, stream.size(), valid.data());
    std::size_t valid_count = 0;
    for (std::size_t i = 0; i < valid.size(); ++i) {
        EXPECT_EQ(valid[i] != 0, core::is_valid_ray(stream.get(i + 3))) << "ray " << i + 3;
        valid_count += valid[i];
    }
    EXPECT_GT(valid_count, 10u);
    EXPECT_LT(valid_count, valid.size() - 10);
}

}  // namespace
