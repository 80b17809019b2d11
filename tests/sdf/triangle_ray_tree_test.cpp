#include "sdf/triangle_ray_tree.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numeric>

#include "sdf/field_kernel.h"
#include "tests/sdf/baked_shapes.h"

namespace tests {
namespace {

/// A mesh in both forms.
struct Soup {
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> corners;

    void add(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
        const auto first = static_cast<std::uint32_t>(positions.size());
        for (const glm::dvec3& corner : {a, b, c}) positions.emplace_back(corner);
        corners.emplace_back(first, first + 1, first + 2);
    }
    sdf::Triangle triangle(std::size_t i) const {
        return {glm::dvec3(positions[corners[i].x]), glm::dvec3(positions[corners[i].y]),
                glm::dvec3(positions[corners[i].z])};
    }
    std::vector<sdf::Triangle> triangles() const {
        std::vector<sdf::Triangle> all;
        for (std::size_t i = 0; i < corners.size(); ++i) all.push_back(triangle(i));
        return all;
    }
    std::vector<std::uint32_t> all() const {
        std::vector<std::uint32_t> numbers(corners.size());
        std::iota(numbers.begin(), numbers.end(), 0u);
        return numbers;
    }
    sdf::TriangleRayTree tree() const { return {positions, corners, all()}; }
};

Soup soup_of(const core::Mesh& mesh) {
    return {mesh.positions, mesh.triangles};
}

/// Every triangle in turn, by the scalar test.
sdf::FirstHit brute_force(const Soup& soup, const sdf::RaySegment& ray) {
    sdf::FirstHit best;
    for (std::uint32_t i = 0; i < soup.corners.size(); ++i) {
        const double t = sdf::intersect(soup.triangle(i), ray.origin, ray.direction);
        if (t >= ray.t_min && t <= ray.t_max && t < best.t) best = {t, i};
    }
    return best;
}

glm::dvec3 anywhere(TestRandom& random, double size) {
    return {random.uniform(-size, size), random.uniform(-size, size), random.uniform(-size, size)};
}

Soup random_soup(TestRandom& random, int count, double size, double thinness) {
    Soup soup;
    for (int i = 0; i < count; ++i) {
        const glm::dvec3 a = anywhere(random, 1.0), along = size * random.direction();
        soup.add(a, a + along, a + random.uniform(0.0, 1.0) * along + thinness * size * random.direction());
    }
    return soup;
}

/// Runs a test once an instruction set.
template <typename Test>
void on_every_target(const Test& test) {
    for (const std::string& target : sdf::kernel_targets()) {
        ASSERT_TRUE(sdf::select_kernel_target(target));
        SCOPED_TRACE(target);
        test();
    }
    sdf::select_kernel_target("");
}

void expect_same(const sdf::FirstHit& found, const sdf::FirstHit& expected) {
    ASSERT_EQ(found.triangle, expected.triangle);
    // To the last bit.
    ASSERT_EQ(std::memcmp(&found.t, &expected.t, sizeof(double)), 0) << found.t << " " << expected.t;
}

TEST(TriangleRayTree, FindsWhatBruteForceFindsToTheLastBit) {
    on_every_target([] {
        TestRandom random(11);
        for (const int count : {1, 3, 4, 5, 9, 33, 400}) {
            for (const double size : {0.02, 0.5}) {
                const Soup soup = random_soup(random, count, size, 0.7);
                const sdf::TriangleRayTree tree = soup.tree();
                int hits = 0;
                for (int i = 0; i < 1000; ++i) {
                    const glm::dvec3 origin = anywhere(random, 2.0);
                    // Half of them towards a triangle; of any length.
                    const sdf::Triangle target = soup.triangle(static_cast<std::size_t>(i % count));
                    const glm::dvec3 direction =
                        i % 2 ? random.direction() : (target.a + target.b + target.c) / 3.0 - origin;
                    const double length = std::exp(random.uniform(-5.0, 5.0));
                    const double t_min = random.uniform(-1.0, 1.0) / length;
                    const sdf::RaySegment ray{origin, length * direction, t_min,
                                              t_min + random.uniform(0.0, 4.0) / length};
                    const sdf::FirstHit expected = brute_force(soup, ray);
                    hits += expected ? 1 : 0;
                    expect_same(tree.hit(ray), expected);
                    const sdf::FirstHit any = tree.hit(ray, sdf::FirstOrAny::kAny);
                    ASSERT_EQ(static_cast<bool>(any), static_cast<bool>(expected));
                    if (any) {
                        ASSERT_EQ(any.t, sdf::intersect(soup.triangle(any.triangle), origin, ray.direction));
                        ASSERT_TRUE(any.t >= ray.t_min && any.t <= ray.t_max);
                    }
                }
                EXPECT_GT(hits, 100);
            }
        }
    });
}

TEST(TriangleRayTree, FindsSliversWhereverTheyLie) {
    on_every_target([] {
        TestRandom random(12);
        // Far from the origin as well, where floats are coarse.
        for (const double far : {0.0, 1e3}) {
            Soup soup = random_soup(random, 300, 0.5, 1e-4);
            for (glm::vec3& position : soup.positions) position += glm::vec3(static_cast<float>(far));
            const sdf::TriangleRayTree tree = soup.tree();
            int hits = 0;
            for (int i = 0; i < 4000; ++i) {
                const sdf::Triangle target = soup.triangle(static_cast<std::size_t>(i % 300));
                const double u = random.uniform(0.0, 1.0), v = random.uniform(0.0, 1.0 - u);
                const glm::dvec3 at = target.a + u * (target.b - target.a) + v * (target.c - target.a);
                const glm::dvec3 direction = random.direction();
                const sdf::RaySegment ray{at - random.uniform(0.0, 3.0) * direction, direction, 0.0, 4.0};
                const sdf::FirstHit expected = brute_force(soup, ray);
                hits += expected ? 1 : 0;
                expect_same(tree.hit(ray), expected);
            }
            EXPECT_GT(hits, 2000);
        }
    });
}

TEST(TriangleRayTree, LeavesNoGapAtEdgesAndVertices) {
    // Rays through points of edges and through vertices of a closed mesh, from far within to far without.
    const Soup soup = soup_of(moved(icosphere(4), rotation(0.4, {1, 2, 3})));
    on_every_target([&] {
        const sdf::TriangleRayTree tree = soup.tree();
        TestRandom random(13);
        for (int i = 0; i < 20'000; ++i) {
            const sdf::Triangle one = soup.triangle(static_cast<std::size_t>(i) % soup.corners.size());
            const double part = i % 3 == 0 ? 0.0 : random.uniform(0.0, 1.0);
            const glm::dvec3 target = one.a + part * (one.b - one.a);
            const glm::dvec3 origin = anywhere(random, 0.3);
            const glm::dvec3 direction = i % 2 ? target - origin : glm::normalize(target - origin);
            const double there = glm::length(target - origin) / glm::length(direction);
            const sdf::FirstHit hit = tree.hit({origin, direction, 0.5 * there, 2.0 * there});
            ASSERT_TRUE(hit);
            ASSERT_NEAR(hit.t, there, 1e-9 * there);
            // In a segment that is next to nothing, too.
            ASSERT_TRUE(tree.hit({origin, direction, hit.t, hit.t}));
        }
    });
}

TEST(TriangleRayTree, FindsFlatBoxesAlongTheirAxes) {
    // A grid in a plane of the axes: boxes without thickness, rays in and across their faces.
    const Soup soup = soup_of(quad(1.0f, 1.0f, 16, 16));
    on_every_target([&] {
        const sdf::TriangleRayTree tree = soup.tree();
        for (int x = -8; x <= 8; ++x) {
            for (int y = -8; y <= 8; ++y) {
                const glm::dvec3 vertex(x / 16.0, y / 16.0, 0.0);
                for (const double side : {-1.0, 1.0}) {
                    const glm::dvec3 up(0.0, 0.0, side);
                    const sdf::RaySegment ray{vertex + up, -up, 0.0, 2.0};
                    expect_same(tree.hit(ray), brute_force(soup, ray));
                    ASSERT_EQ(tree.hit(ray).t, 1.0);
                    ASSERT_FALSE(tree.hit({vertex + up, -up, 0.0, std::nextafter(1.0, 0.0)}));
                    ASSERT_FALSE(tree.hit({vertex + up, -up, std::nextafter(1.0, 2.0), 2.0}));
                    // Within the plane of the triangles there is nothing to meet.
                    ASSERT_FALSE(tree.hit({vertex, {side, 0.0, 0.0}, -2.0, 2.0}));
                }
            }
        }
    });
}

TEST(TriangleRayTree, TakesTheLowerIndexAtEqualDistance) {
    Soup soup;
    for (int i = 0; i < 40; ++i) soup.add({-1, -1, 0.5}, {1, -1, 0.5}, {0, 1, 0.5});
    std::vector<std::uint32_t> selection;
    for (std::uint32_t i = 40; i-- > 7;) selection.push_back(i);
    on_every_target([&] {
        const sdf::TriangleRayTree tree(soup.positions, soup.corners, selection);
        EXPECT_EQ(tree.hit({{0.1, 0.1, 2.0}, {0, 0, -1}, 0.0, 9.0}).triangle, 7u);
        EXPECT_EQ(tree.hit({{0.1, 0.1, 2.0}, {0, 0, -1}, 0.0, 1.5}).triangle, 7u);
    });
}

TEST(TriangleRayTree, FindsTrianglesFromVeryFarAway) {
    const Soup soup = soup_of(icosphere(3));
    on_every_target([&] {
        const sdf::TriangleRayTree tree = soup.tree();
        TestRandom random(14);
        for (const double far : {1e3, 1e6, 1e9}) {
            for (int i = 0; i < 2000; ++i) {
                const glm::dvec3 direction = random.direction();
                const glm::dvec3 target = anywhere(random, 0.7);
                const sdf::RaySegment ray{target - far * direction, direction, far - 4.0, far + 4.0};
                const sdf::FirstHit expected = brute_force(soup, ray), found = tree.hit(ray);
                expect_same(found, expected);
            }
        }
    });
}

TEST(TriangleRayTree, IsNoDeeperThanItsStackWhateverTheTriangles) {
    // Each triangle a third of the size of the one before: splits by area take them off one by one.
    Soup soup;
    double size = 1.0;
    for (int i = 0; i < 70; ++i, size /= 3.0) {
        for (int j = 0; j < 8; ++j)
            soup.add({size, 0, j * size}, {size, size, j * size}, {0, size, j * size});
    }
    on_every_target([&] {
        const sdf::TriangleRayTree tree = soup.tree();
        TestRandom random(15);
        for (int i = 0; i < 2000; ++i) {
            const double scale = std::pow(3.0, -random.uniform(0.0, 20.0));
            const sdf::RaySegment ray{scale * anywhere(random, 2.0), random.direction(), 0.0, 4.0 * scale};
            expect_same(tree.hit(ray), brute_force(soup, ray));
        }
    });
}

TEST(TriangleRayTree, AnswersManyQueriesToSeveralTreesAsEachAlone) {
    TestRandom random(16);
    const Soup soups[] = {random_soup(random, 200, 0.3, 0.7), random_soup(random, 3, 0.9, 0.7), Soup()};
    on_every_target([&] {
        const sdf::TriangleRayTree trees[] = {soups[0].tree(), soups[1].tree(), soups[2].tree()};
        for (const std::size_t count : {0, 1, 7, 8, 9, 500}) {
            std::vector<sdf::TriangleQuery> queries(count);
            for (sdf::TriangleQuery& query : queries) {
                query.tree = &trees[static_cast<std::size_t>(random.uniform(0.0, 2.999))];
                query.ray = {anywhere(random, 1.0), random.direction(), 0.0, random.uniform(-0.1, 2.0)};
                query.which =
                    random.uniform(0.0, 1.0) < 0.3 ? sdf::FirstOrAny::kAny : sdf::FirstOrAny::kFirst;
            }
            sdf::hit_triangles(queries);
            for (const sdf::TriangleQuery& query : queries) {
                expect_same(query.hit, query.tree->hit(query.ray, query.which));
                if (query.which == sdf::FirstOrAny::kAny) continue;
                expect_same(query.hit, brute_force(soups[query.tree - trees], query.ray));
            }
        }
    });
}

TEST(TriangleRayTree, WithoutTrianglesOrLengthFindsNothing) {
    EXPECT_FALSE(sdf::TriangleRayTree().hit({{0, 0, 0}, {0, 0, 1}, 0.0, 1.0}));
    const Soup soup = soup_of(icosphere(1));
    EXPECT_FALSE(soup.tree().hit({{0, 0, 0}, {0, 0, 1}, 2.0, 0.0}));
}

TEST(TriangleRayTree, TakesTheMemoryThatIsForeseen) {
    for (const core::Mesh& mesh : {icosphere(5), quad(1.0f, 1.0f, 60, 60)}) {
        const std::size_t foreseen = sdf::TriangleRayTree::bytes_of(mesh.triangles.size());
        EXPECT_LE(soup_of(mesh).tree().bytes(), foreseen);
        EXPECT_GT(soup_of(mesh).tree().bytes(), foreseen * 8 / 10);
    }
}

}  // namespace
}  // namespace tests
