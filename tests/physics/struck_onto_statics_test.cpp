// Bodies that touch no static when a step begins, and are hit onto one within it.
#include <gtest/gtest.h>

#include <random>

#include "tests/physics/scenes.hpp"

namespace soda::physics::test {
namespace {

// The step's change of momentum is what gravity and statics gave.
double momentum_error(const World& world, const Mechanics& before) {
  double mass_kg = 0.0;
  for (const BodyParams& body : world.scene.bodies) mass_kg += body.mass_kg;
  Vec3 given = world.scene.gravity_m_s2 * (mass_kg * world.scene.dt_s);
  double scale = before.momentum_scale_newton_s + given.norm();
  for (const IslandReport& island : world.report.islands) {
    given += island.static_impulse_newton_s;
    scale += island.static_impulse_newton_s.norm();
  }
  const Vec3 got = world.mechanics().linear_momentum_newton_s - before.linear_momentum_newton_s;
  return (got - given).norm() / scale;
}

void expect_no_gain(const World& world, const Mechanics& before) {
  double pushed = 0.0;
  for (const IslandReport& island : world.report.islands)
    pushed += std::max(0.0, island.push_out_work_joule);
  const Mechanics now = world.mechanics();
  EXPECT_LE(now.kinetic_energy_joule + now.potential_energy_joule,
            before.kinetic_energy_joule + before.potential_energy_joule + pushed +
                1e-9 * (before.kinetic_energy_joule + std::abs(before.potential_energy_joule)));
}

// How deep a sphere is in the floor, of its radius.
double depth(const World& world, std::size_t body) {
  const double radius_m =
      std::get<Sphere>(world.scene.shapes[world.scene.bodies[body].shape]).radius_m;
  return 1.0 - world.states[body].position_m.z() / radius_m;
}

TEST(StruckOntoStatics, ASphereThatRisesIsHitOntoTheFloorAndStopsThere) {
  World world = under_gravity();
  world.scene.dt_s = 1.0 / 60.0;
  world.add_floor(Material{.friction = 0.6, .restitution = 0.0});
  const Material rubber{.friction = 0.3, .restitution = 0.5};
  const std::uint32_t ball = world.add_shape(Sphere{0.5});
  BodyState& low = world.add_body(ball, Vec3(0.18, -0.27, 0.5333), 1.9, rubber);
  low.linear_velocity_m_s = Vec3(2.2, -4.5, 2.4);
  low.angular_velocity_rad_s = Vec3(9.0, 4.4, -10.2);
  BodyState& high = world.add_body(ball, Vec3(0, 0, 1.4059), 1.9, rubber);
  high.linear_velocity_m_s = Vec3(-3.5, -3.8, -18.9);
  const Mechanics before = world.mechanics();
  world.run(1);
  EXPECT_LT(momentum_error(world, before), 1e-12);
  EXPECT_LT(depth(world, 0), 0.01);
  expect_no_gain(world, before);
}

TEST(StruckOntoStatics, SpheresOfAnySizeSpeedAndMaterialKeepTheBalanceOfMomentum) {
  std::mt19937_64 random(23);
  const auto share = [&random] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  for (int trial = 0; trial < 2000; ++trial) {
    World world = under_gravity();
    world.scene.dt_s = 1.0 / (30.0 + 210.0 * share());
    const Material material{.friction = share(), .restitution = trial % 4 == 0 ? 0.0 : share()};
    world.add_floor(material);
    double top_m = 0.0;
    const int bodies = 2 + trial % 3;
    for (int i = 0; i < bodies; ++i) {
      const double radius_m = 0.1 + 0.5 * share();
      BodyState& ball =
          world.add_body(world.add_shape(Sphere{radius_m}),
                         Vec3(0.1 * share(), 0.1 * share(), top_m + radius_m + 0.1 * share()),
                         1.0 + share(), material);
      top_m = ball.position_m.z() + radius_m;
      ball.linear_velocity_m_s =
          Vec3(4.0 * share() - 2.0, 4.0 * share() - 2.0, i == 0 ? 4.0 * share() : -40.0 * share());
      ball.angular_velocity_rad_s = 20.0 * Vec3(share(), share(), share());
    }
    std::vector<double> deep;
    for (std::size_t i = 0; i < world.states.size(); ++i) deep.push_back(depth(world, i));
    const Mechanics before = world.mechanics();
    world.run(1);
    SCOPED_TRACE("trial " + std::to_string(trial));
    EXPECT_LT(momentum_error(world, before), 1e-12);
    expect_no_gain(world, before);
    for (std::size_t i = 0; i < world.states.size(); ++i) EXPECT_LT(depth(world, i), 0.1) << i;
  }
}

}  // namespace
}  // namespace soda::physics::test
