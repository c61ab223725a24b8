#include "physics/broadphase/pair_cache.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <optional>
#include <random>

#include "physics/integrators/advance_once.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::World;

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double between(double low, double high) {
    return low + (high - low) * (static_cast<double>(engine_() >> 11) * 0x1p-53);
  }
  bool one_of(int n) { return engine_() % static_cast<std::uint64_t>(n) == 0; }
  std::size_t below(std::size_t n) { return engine_() % n; }
  Vec3 in_cube(double half) {
    const double x = between(-half, half), y = between(-half, half);
    return {x, y, between(-half, half)};
  }
  Quat attitude() {
    const Vec3 v = in_cube(1.0);
    return Quat(between(-1.0, 1.0), v.x(), v.y(), v.z()).normalized();
  }

 private:
  std::mt19937_64 engine_;
};

World random_gas(int count, double half_m, double speed_m_s, double angular_speed_rad_s,
                 Random& random) {
  World world;
  const std::uint32_t shapes[] = {world.add_shape(Box{Vec3(0.5, 0.4, 0.3)}),
                                  world.add_shape(Sphere{0.4}), world.add_shape(Capsule{0.2, 0.8}),
                                  world.add_shape(Cylinder{0.3, 0.9})};
  for (int i = 0; i < count; ++i) {
    BodyState& state = world.add_body(shapes[random.below(4)], random.in_cube(half_m));
    state.orientation = random.attitude();
    state.linear_velocity_m_s = random.in_cube(speed_m_s);
    state.angular_velocity_rad_s = random.in_cube(angular_speed_rad_s);
  }
  return world;
}

std::vector<IndexPair> all_pairs(const World& world, const Geometry& geometry,
                                 std::span<const BodyId> ids, std::span<const BodyState> states) {
  std::vector<Aabb> boxes;
  std::vector<IndexPair> pairs;
  StageCounters counters;
  compute_boxes(world.scene, geometry, ids, states, boxes, counters);
  find_pairs(Broadphase::kAllPairs, boxes, pairs, counters);
  return pairs;
}

// Asks with boxes and without, in turn, and compares with all pairs.
class Asked {
 public:
  void expect_all(const World& world, const Geometry& geometry, std::span<const BodyId> ids,
                  std::span<const BodyState> states) {
    const std::vector<IndexPair> expected = all_pairs(world, geometry, ids, states);
    std::vector<Aabb> boxes;
    StageCounters counters;
    if (++asked_ % 3 == 0) compute_boxes(world.scene, geometry, ids, states, boxes, counters);
    cache_.find({world.scene, geometry, ids, states, boxes}, pairs_, counters);
    EXPECT_EQ(pairs_, expected) << "at " << asked_;
    EXPECT_EQ(counters.candidate_pairs, expected.size());
    if (boxes.empty()) expect_rooms(world, geometry, ids, states);
    served += cache_.served();
    found += expected.size();
  }
  int served = 0;
  std::size_t found = 0;

 private:
  // Absurd places are in no fat box that is a number.
  void expect_rooms(const World& world, const Geometry& geometry, std::span<const BodyId> ids,
                    std::span<const BodyState> states) const {
    for (std::uint32_t i = 0; i < ids.size(); ++i) {
      const Aabb box = swept_aabb(world.scene, geometry, ids[i], states[i]),
                 fat_box = cache_.fat_box(i);
      for (int axis = 0; axis < 3; ++axis) {
        EXPECT_FALSE(fat_box.min[axis] > box.min[axis]) << i << " at " << asked_;
        EXPECT_FALSE(fat_box.max[axis] < box.max[axis]) << i << " at " << asked_;
      }
    }
  }

  PairCache cache_;
  std::vector<IndexPair> pairs_;
  int asked_ = 0;
};

void fly(World& world) {
  std::vector<AdvanceFault> faults;
  for (std::size_t i = 0; i < world.ids.size(); ++i)
    advance_free_body(world.scene, world.scene.dt_s, world.ids[i], world.states[i], world.counters,
                      faults);
}

// A few are hit: other velocities, linear and angular, some of them absurd; some are put elsewhere.
void disturb(World& world, double half_m, Random& random) {
  for (BodyState& state : world.states) {
    if (!random.one_of(60)) continue;
    if (random.one_of(2)) state.linear_velocity_m_s = random.in_cube(10.0);
    if (random.one_of(2)) state.angular_velocity_rad_s = random.in_cube(40.0);
    if (random.one_of(4)) state.position_m = random.in_cube(half_m);
    if (random.one_of(8)) state.linear_velocity_m_s = random.in_cube(1e5);
    if (random.one_of(16)) state.position_m = random.in_cube(1e11);
    if (random.one_of(16)) state.angular_velocity_rad_s = random.in_cube(1e8);
  }
}

TEST(PairCache, AreThoseOfAllBoxesWhileBodiesFlySpinAndAreHit) {
  int served = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    Random random(seed);
    World world = random_gas(300, 6.0, seed % 2 == 0 ? 4.0 : 0.2, 5.0, random);
    if (seed % 3 == 0) world.scene.gravity_m_s2 = random.in_cube(10.0);
    const Geometry geometry(world.scene);
    Asked asked;
    for (int step = 0; step < 60; ++step) {
      asked.expect_all(world, geometry, world.ids, world.states);
      ASSERT_FALSE(HasFailure()) << "seed " << seed;
      fly(world);
      if (seed % 4 != 0) disturb(world, 6.0, random);
    }
    EXPECT_GT(asked.found, 1000u);
    served += asked.served;
  }
  EXPECT_GT(served, 360);  // of 720
}

// Every third body, at once and hard: by a force, a thruster, a torque or a drive.
void push_some(World& world, Random& random) {
  SceneDescription& scene = world.scene;
  for (std::size_t i = 0; i < scene.bodies.size(); i += 3) {
    BodyParams& body = scene.bodies[i];
    if (random.one_of(2)) body.own_field_m_s2 = random.in_cube(300.0);
    if (random.one_of(2)) {
      scene.forces.push_back({.body_force_newton = random.in_cube(300.0) * body.mass_kg,
                              .torque_newton_m = random.in_cube(3e4) * body.mass_kg,
                              .linear_damping_1_s = random.between(0.0, 20.0)});
      body.forces = static_cast<std::uint32_t>(scene.forces.size() - 1);
    }
    if (random.one_of(2)) {
      scene.drives.push_back({.time_constant_s = 0.01,
                              .max_acceleration_m_s2 = 300.0,
                              .velocity_m_s = random.in_cube(20.0),
                              .lane = std::nullopt});
      body.drive = static_cast<std::uint32_t>(scene.drives.size() - 1);
    }
  }
}

TEST(PairCache, AreThoseOfAllBoxesWhileBodiesArePushed) {
  int served = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    Random random(seed);
    World world = random_gas(150, 5.0, 0.2, 1.0, random);
    push_some(world, random);
    const Geometry geometry(world.scene);
    Asked asked;
    for (int step = 0; step < 6; ++step) {
      asked.expect_all(world, geometry, world.ids, world.states);
      ASSERT_FALSE(HasFailure()) << "seed " << seed << ", step " << step;
      if (step % 2 == 1) fly(world);
    }
    served += asked.served;
  }
  EXPECT_GT(served, 10);
}

TEST(PairCache, AreThoseOfTheBodiesAskedForThoughSomeComeAndGo) {
  Random random(5);
  World world = random_gas(300, 6.0, 3.0, 3.0, random);
  const Geometry geometry(world.scene);
  Asked asked;
  for (int step = 0; step < 120; ++step) {
    std::vector<BodyId> ids;
    std::vector<BodyState> states;
    for (std::size_t i = 0; i < world.ids.size(); ++i) {
      if ((i + static_cast<std::size_t>(step) / 8) % 7 == 0) continue;
      ids.push_back(world.ids[i]);
      states.push_back(world.states[i]);
    }
    asked.expect_all(world, geometry, ids, states);
    fly(world);
  }
  EXPECT_GT(asked.served, 40);
}

TEST(PairCache, AreThoseOfAnEarlierTimeAfterARollbackAndOfAnotherSceneInTheSameMemory) {
  Random random(6);
  World slow = random_gas(200, 5.0, 2.0, 2.0, random);
  World large = random_gas(200, 5.0, 2.0, 2.0, random);
  for (Shape& shape : large.scene.shapes) shape = Sphere{0.9};
  const Geometry slow_geometry(slow.scene), large_geometry(large.scene);
  const std::vector<BodyState> start = slow.states;
  Asked asked;
  for (int step = 0; step < 60; ++step) {
    asked.expect_all(slow, slow_geometry, slow.ids, slow.states);
    if (step % 20 == 10) asked.expect_all(large, large_geometry, large.ids, large.states);
    if (step % 25 == 24) slow.states = start;
    if (step == 40) slow.scene.dt_s *= 4.0;
    fly(slow);
  }
}

TEST(PairCache, OfBodiesAtRestAreKeptForGood) {
  Random random(7);
  World world = random_gas(200, 5.0, 0.0, 0.0, random);
  const Geometry geometry(world.scene);
  Asked asked;
  for (int step = 0; step < 50; ++step) asked.expect_all(world, geometry, world.ids, world.states);
  EXPECT_EQ(asked.served, 50);
}

TEST(PairCache, OfBodiesWithoutNumbersAreThoseOfTheirBoxes) {
  Random random(8);
  World world = random_gas(100, 4.0, 1.0, 1.0, random);
  const Geometry geometry(world.scene);
  Asked asked;
  for (int step = 0; step < 20; ++step) {
    asked.expect_all(world, geometry, world.ids, world.states);
    fly(world);
    if (step == 5) world.states[3].position_m.x() = std::numeric_limits<double>::infinity();
    if (step == 6) world.states[4].position_m.y() = std::numeric_limits<double>::quiet_NaN();
    if (step == 7) world.states[5].linear_velocity_m_s.x() = std::nan("");
    if (step == 8) world.states[6].orientation.w() = 1e9;
  }
}

}  // namespace
}  // namespace soda::physics
