#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

// Raw bits only: the standard distributions may differ between libraries.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double unit() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  double between(double low, double high) { return low + (high - low) * unit(); }
  Vec3 in_cube(double half) {
    const double x = between(-half, half), y = between(-half, half);
    return {x, y, between(-half, half)};
  }

 private:
  std::mt19937_64 engine_;
};

std::vector<IndexPair> brute_force(const std::vector<Aabb>& boxes) {
  std::vector<IndexPair> pairs;
  for (std::uint32_t i = 0; i < boxes.size(); ++i) {
    for (std::uint32_t j = i + 1; j < boxes.size(); ++j) {
      if (overlap(boxes[i], boxes[j])) pairs.push_back({i, j});
    }
  }
  return pairs;
}

std::vector<IndexPair> by_grid(const std::vector<Aabb>& boxes) {
  std::vector<IndexPair> pairs;
  StageCounters counters;
  find_pairs(Broadphase::kGrid, boxes, pairs, counters);
  EXPECT_EQ(counters.candidate_pairs, pairs.size());
  return pairs;
}

Aabb around(const Vec3& center, const Vec3& half) { return {center - half, center + half}; }

TEST(Broadphase, GridFindsTheSamePairsAsBruteForceOnRandomBoxes) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    Random random(seed);
    std::vector<Aabb> boxes;
    const int n = 2 + static_cast<int>(random.between(0, 400));
    for (int i = 0; i < n; ++i) {
      boxes.push_back(around(random.in_cube(8.0), Vec3::Constant(random.between(0.1, 1.0))));
    }
    const std::vector<IndexPair> expected = brute_force(boxes);
    EXPECT_EQ(by_grid(boxes), expected) << "seed " << seed;
  }
}

TEST(Broadphase, GridFindsTheSamePairsAsBruteForceOnThousandsOfBoxes) {
  Random random(7);
  std::vector<Aabb> boxes;
  for (int i = 0; i < 4000; ++i) boxes.push_back(around(random.in_cube(15.0), Vec3(0.6, 0.5, 0.7)));
  const std::vector<IndexPair> expected = brute_force(boxes);
  ASSERT_GT(expected.size(), 1000u);
  EXPECT_EQ(by_grid(boxes), expected);
}

TEST(Broadphase, SizeRatiosOfManyOrdersOfMagnitudeLoseNoPair) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    std::vector<Aabb> boxes;
    for (int i = 0; i < 500; ++i) {
      const double size = std::ldexp(1.0, static_cast<int>(random.between(-20, 12)));
      boxes.push_back(around(random.in_cube(100.0), random.in_cube(size).cwiseAbs()));
    }
    EXPECT_EQ(by_grid(boxes), brute_force(boxes)) << "seed " << seed;
  }
}

TEST(Broadphase, DistanceFromTheOriginLosesNoPair) {
  for (const double offset : {1e7, -1e7, 1e12, 1e15, 1e17}) {
    Random random(3);
    std::vector<Aabb> boxes;
    for (int i = 0; i < 300; ++i) {
      const Vec3 center = Vec3(offset, -offset, 0.5 * offset) + random.in_cube(5.0);
      boxes.push_back(around(center, Vec3::Constant(0.4)));
    }
    EXPECT_EQ(by_grid(boxes), brute_force(boxes)) << "offset " << offset;
  }
}

// Corners on cell borders, where rounding would show first.
TEST(Broadphase, TouchingBoxesOnARegularLatticeLoseNoPairAtAnyOffset) {
  for (const double offset : {0.0, 1e4, 1e7, 0.1, 1e9, 1e13}) {
    for (const double size : {1.0, 0.1, 1.0 / 3.0}) {
      std::vector<Aabb> boxes;
      for (int i = 0; i < 343; ++i) {
        const Vec3 low = Vec3::Constant(offset) + size * Vec3(i % 7, i / 7 % 7, i / 49);
        boxes.push_back({low, low + Vec3::Constant(size)});
      }
      EXPECT_EQ(by_grid(boxes), brute_force(boxes)) << "offset " << offset << " size " << size;
    }
  }
}

TEST(Broadphase, IdenticalBoxesAllPairUp) {
  const std::vector<Aabb> boxes(60, around(Vec3(1, 2, 3), Vec3::Constant(0.5)));
  EXPECT_EQ(by_grid(boxes).size(), 60u * 59u / 2u);
}

TEST(Broadphase, AbsurdBoxesAmongOrdinaryOnesLoseNoPair) {
  Random random(5);
  std::vector<Aabb> boxes;
  for (int i = 0; i < 200; ++i) {
    boxes.push_back(around(random.in_cube(5.0), Vec3::Constant(0.5)));
  }
  boxes.push_back({Vec3::Constant(-1e300), Vec3::Constant(1e300)});
  boxes.push_back({Vec3(-1e300, 0, 0), Vec3(1e300, 0.1, 0.1)});
  boxes.push_back({Vec3::Constant(1e299), Vec3::Constant(1e300)});
  boxes.push_back({Vec3::Constant(0.0), Vec3::Constant(0.0)});
  boxes.push_back({Vec3::Constant(0.0), Vec3::Constant(0.0)});
  boxes.push_back({Vec3::Constant(0.0), Vec3::Constant(1e-300)});
  const double largest = std::numeric_limits<double>::max();
  boxes.push_back({Vec3::Constant(-largest), Vec3::Constant(largest)});
  EXPECT_EQ(by_grid(boxes), brute_force(boxes));
}

TEST(Broadphase, BoxesThatShareAFaceOverlap) {
  std::vector<Aabb> boxes;
  for (int i = 0; i < 50; ++i) boxes.push_back({Vec3(i, 0, 0), Vec3(i + 1, 1, 1)});
  EXPECT_EQ(by_grid(boxes).size(), 49u);
}

TEST(Broadphase, AllPairsModeGivesTheSamePairs) {
  Random random(11);
  std::vector<Aabb> boxes;
  for (int i = 0; i < 100; ++i) boxes.push_back(around(random.in_cube(3.0), Vec3::Constant(0.5)));
  std::vector<IndexPair> pairs;
  StageCounters counters;
  find_pairs(Broadphase::kAllPairs, boxes, pairs, counters);
  EXPECT_EQ(pairs, by_grid(boxes));
}

TEST(StaticPairs, FindBoxesThatOverlapAStaticBoxOrReachAHalfspace) {
  test::World world;
  world.add_floor();
  const std::uint32_t tilted = world.add_shape(HalfSpace{Vec3(3, 0, 4), 10.0});  // x*.6+z*.8 <= 2
  world.add_static(tilted);
  const std::uint32_t wall = world.add_shape(Box{Vec3(1, 1, 1)});
  world.add_static(wall, Vec3(10, 0, 5), test::about(Vec3::UnitZ(), M_PI / 4));
  const Geometry geometry(world.scene);
  std::vector<Aabb> boxes = {
      around(Vec3(100, 0, 0.4), Vec3::Constant(0.5)),  // floor only
      around(Vec3(100, 0, 0.6), Vec3::Constant(0.5)),  // nothing
      around(Vec3(2, 0, 2), Vec3::Constant(0.8)),      // reaches the tilted halfspace
      around(Vec3(11.8, 0, 5), Vec3::Constant(0.5)),   // inside the turned wall's box (1.414)
      around(Vec3(12, 0, 5), Vec3::Constant(0.5)),     // beyond it
  };
  std::vector<IndexPair> pairs;
  StageCounters counters;
  find_static_pairs(geometry, boxes, pairs, counters);
  EXPECT_EQ(pairs, (std::vector<IndexPair>{{0, 0}, {2, 1}, {3, 2}}));
}

TEST(SweptAabb, ContainsTheBodyAtTheEndOfTheStep) {
  Random random(2);
  for (int trial = 0; trial < 200; ++trial) {
    test::World world = test::under_gravity();
    const std::uint32_t box = world.add_shape(Box{Vec3(0.2, 0.5, 1.0)});
    BodyState& state = world.add_body(box, random.in_cube(10.0));
    state.linear_velocity_m_s = random.in_cube(50.0);
    state.angular_velocity_rad_s = random.in_cube(20.0);
    state.orientation = test::about(random.in_cube(1.0), random.between(0, 6));
    const Geometry geometry(world.scene);
    const Aabb swept = swept_aabb(world.scene, geometry, BodyId{0}, state);
    world.run(1);
    const Mat3 rotation = world.states[0].orientation.toRotationMatrix();
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3 sign(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
      const Vec3 p = world.states[0].position_m + rotation * sign.cwiseProduct(Vec3(0.2, 0.5, 1.0));
      EXPECT_TRUE((p.array() >= swept.min.array()).all() && (p.array() <= swept.max.array()).all());
    }
  }
}

TEST(SweptAabb, OfABodyAtRestIsTightUpToTheMargin) {
  test::World world;
  const std::uint32_t shape = world.add_shape(Cylinder{0.5, 2.0});
  world.add_body(shape, Vec3(1, 2, 3)).orientation = test::about(Vec3::UnitX(), M_PI / 2);
  const Geometry geometry(world.scene);
  const Aabb box = swept_aabb(world.scene, geometry, BodyId{0}, world.states[0]);
  const double margin = 0.01;  // 1 % of the smallest width, 1 m
  EXPECT_NEAR(box.max.x(), 1.5 + margin, 1e-12);
  EXPECT_NEAR(box.max.y(), 3.0 + margin, 1e-12);
  EXPECT_NEAR(box.max.z(), 3.5 + margin, 1e-12);
}

}  // namespace
}  // namespace soda::physics
