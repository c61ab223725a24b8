#include "physics/integrators/free_flight.hpp"

#include <gtest/gtest.h>

#include <random>

#include "physics/integrators/advance_once.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::World;

double unit(std::mt19937_64& engine) {
  return 2.0 * (static_cast<double>(engine() >> 11) * 0x1p-53) - 1.0;
}
Vec3 random_vector(std::mt19937_64& engine) {
  const double x = unit(engine), y = unit(engine);
  return {x, y, unit(engine)};
}

// Bodies of one, two and three moments; angular velocities of any size, none, and beyond what is
// allowed.
World mixed_bodies(std::uint64_t seed, bool all_cubes) {
  std::mt19937_64 engine(seed);
  World world;
  world.scene.gravity_m_s2 = seed % 2 == 0 ? Vec3(0.1, -0.2, -9.81) : Vec3(Vec3::Zero());
  const std::uint32_t shapes[] = {
      world.add_shape(Box{Vec3::Constant(0.5)}), world.add_shape(Sphere{0.3}),
      world.add_shape(Box{Vec3(0.5, 0.5, 0.1)}), world.add_shape(Box{Vec3(0.5, 0.3, 0.1)})};
  // Those of 25 show whether sums have one order: the angle is almost as large as a series can be.
  const double angular_speeds[] = {0.0, 1e-170, 25.0, 1.0, 25.0, 29.0, 31.0, 1e4, 0.9e9, 2e9};
  for (int i = 0; i < 101; ++i) {
    BodyState& state =
        world.add_body(shapes[engine() % (all_cubes ? 2 : 4)], 100.0 * random_vector(engine));
    state.orientation = Quat(unit(engine), unit(engine), unit(engine), unit(engine)).normalized();
    state.linear_velocity_m_s = 10.0 * random_vector(engine);
    state.angular_velocity_rad_s =
        angular_speeds[engine() % (i % 2 == 0 ? 10 : 6)] * random_vector(engine);
    if (engine() % 16 == 0) state.linear_velocity_m_s *= 1e8;
    if (engine() % 16 == 0) state.position_m *= 1e10;
    if (engine() % 16 == 0) state.orientation.w() = 3.0;
    if (engine() % 4 == 0) state.impulses.push_back({});
  }
  return world;
}

TEST(FreeFlight, ManyAtATimeHaveTheBitsAndTheFaultsOfOneAfterTheOther) {
  std::size_t faults_seen = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    World world = mixed_bodies(seed, seed % 3 != 0);
    const Geometry geometry(world.scene);
    std::vector<BodyState> alone = world.states;
    std::vector<std::uint32_t> free;
    for (std::uint32_t i = 0; i < alone.size(); ++i)
      if (i % 5 != 2) free.push_back(i);
    std::vector<AdvanceFault> faults, faults_alone;
    StageCounters counters, counters_alone;
    for (int step = 0; step < 10; ++step) {
      for (const std::uint32_t i : free)
        advance_free_body(world.scene, world.scene.dt_s, world.ids[i], alone[i], counters_alone,
                          faults_alone);
      advance_free_bodies(whole_step(world.scene, geometry, world.ids, {}), free, world.states,
                          counters, faults);
    }
    for (std::uint32_t i = 0; i < alone.size(); ++i)
      EXPECT_TRUE(identical(alone[i], world.states[i])) << "seed " << seed << ", body " << i;
    ASSERT_EQ(faults.size(), faults_alone.size());
    for (std::size_t i = 0; i < faults.size(); ++i)
      EXPECT_EQ(index_of(faults[i].body), index_of(faults_alone[i].body));
    EXPECT_EQ(counters.free_bodies_advanced, counters_alone.free_bodies_advanced);
    faults_seen += faults.size();
  }
  EXPECT_GT(faults_seen, 100u);
}

}  // namespace
}  // namespace soda::physics
