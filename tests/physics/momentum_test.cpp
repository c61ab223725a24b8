// What an island keeps that nothing outside acts on.
#include "physics/integrators/momentum.hpp"

#include <gtest/gtest.h>

#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::kGravity;
using test::World;

// Four boxes that overlap, turn and fly through each other: they are pushed apart and rub.
World tangle() {
  World world;
  world.scene.gravity_m_s2 = Vec3(0, 0, -kGravity);
  const std::uint32_t box = world.add_shape(Box{Vec3(0.4, 0.3, 0.2)});
  for (int i = 0; i < 4; ++i) {
    BodyState& body =
        world.add_body(box, Vec3(0.35 * i, 0.05 * (i % 2), 0.02 * i), 1000.0 * (1 + 10 * i));
    body.linear_velocity_m_s = Vec3(1.0 - i, 0.3 * i, 0.1);
    body.angular_velocity_rad_s = Vec3(1.0, -2.0 * i, 3.0);
  }
  return world;
}

TEST(Momentum, OfOverlappingTurningBoxesIsKeptToRoundingAndTheirCentreFlies) {
  World world = tangle();
  const Geometry geometry(world.scene);
  bool pushed = false;
  for (int step = 0; step < 30; ++step) {
    const IslandMomentum before = momentum_of(world.scene, world.ids, world.states);
    world.run(1, geometry);
    for (const IslandReport& island : world.report.islands)
      pushed = pushed || island.max_penetration_m > 1e-3;
    const IslandMomentum after = momentum_of(world.scene, world.ids, world.states);
    const double dt = world.scene.dt_s;
    const Vec3 displacement =
        dt * (before.linear_newton_s / before.mass_kg) + 0.5 * dt * dt * world.scene.gravity_m_s2;
    EXPECT_LE((after.centre_m - before.centre_m - displacement).norm(), 1e-14) << step;
    EXPECT_LE((after.angular_newton_m_s - before.angular_newton_m_s).norm(),
              1e-13 * before.angular_newton_m_s.norm())
        << step;
    EXPECT_LE(after.kinetic_joule, before.kinetic_joule * (1.0 + 1e-13)) << step;
  }
  EXPECT_TRUE(pushed);
}

// Two bodies that turn as one, put nearer to their centre: with L kept, energy would rise.
TEST(Momentum, EnergyComesFirstWhereAWholeTurnsAsOneBody) {
  World world;
  const std::uint32_t ball = world.add_shape(Sphere{0.1});
  for (const double x : {-0.1, 0.1}) {
    BodyState& body = world.add_body(ball, Vec3(x, 0, 0));
    body.angular_velocity_rad_s = Vec3(0, 0, 5.0);
    body.linear_velocity_m_s = Vec3(0, 5.0 * x, 0);
  }
  const IslandMomentum before = momentum_of(world.scene, world.ids, world.states);
  for (BodyState& state : world.states) state.position_m *= 0.99;
  keep_momentum(world.scene, 0.0, world.ids, before, world.states);
  const IslandMomentum after = momentum_of(world.scene, world.ids, world.states);
  EXPECT_NEAR(after.kinetic_joule, before.kinetic_joule, 1e-13 * before.kinetic_joule);
  EXPECT_LT(after.angular_newton_m_s.z(), before.angular_newton_m_s.z());
  EXPECT_GT(after.angular_newton_m_s.z(), 0.98 * before.angular_newton_m_s.z());
}

TEST(Momentum, OfAnIslandThatTouchesAStaticIsNotItsOwn) {
  World world = tangle();
  std::vector<ContactManifold> manifolds(2);
  manifolds[0].a = BodyId{0};
  manifolds[0].b = BodyId{1};
  manifolds[1].a = BodyId{1};
  manifolds[1].b = BodyId{2};
  EXPECT_TRUE(is_isolated_system(world.scene, world.ids, manifolds, world.states));
  manifolds[1].b = static_id(0);
  EXPECT_FALSE(is_isolated_system(world.scene, world.ids, manifolds, world.states));
}

}  // namespace
}  // namespace soda::physics
