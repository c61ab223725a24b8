// Impacts located in time.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "physics/continuous/time_of_impact.hpp"
#include "physics/step/advance_island.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::kGravity;
using test::World;

TEST(TimeOfImpact, OfAFallingSphereIsTheRootOfItsParabola) {
  World world;
  world.scene.gravity_m_s2 = Vec3(0, 0, -kGravity);
  world.add_floor();
  world.add_body(world.add_shape(Sphere{0.1}), Vec3(0, 0, 1.1));
  const Geometry geometry(world.scene);
  const auto impact = time_of_impact(
      {world.scene, geometry, 1.0, BodyId{0}, world.states[0], static_id(0), nullptr});
  ASSERT_TRUE(impact.has_value());
  EXPECT_FALSE(impact->lasts);
  EXPECT_NEAR(impact->time_s, std::sqrt(2.0 / kGravity), 1e-14);
}

TEST(TimeOfImpact, OfASpinningRodIsWhenItsTipArrives) {
  World world;
  world.add_static(world.add_shape(HalfSpace{Vec3::UnitX(), -1.0}));
  BodyState& rod = world.add_body(world.add_shape(Box{Vec3(0.5, 1e-3, 1e-3)}), Vec3(0, 0, 0));
  rod.angular_velocity_rad_s = Vec3(0, 0, 20);
  rod.linear_velocity_m_s = Vec3(-2, 0, 0);
  const Geometry geometry(world.scene);
  const auto impact = time_of_impact(
      {world.scene, geometry, 1.0, BodyId{0}, world.states[0], static_id(0), nullptr});
  ASSERT_TRUE(impact.has_value());
  const double angle = 20.0 * impact->time_s;
  const double lowest =
      -2.0 * impact->time_s - 0.5 * std::abs(std::cos(angle)) - 1e-3 * std::abs(std::sin(angle));
  EXPECT_NEAR(lowest, -1.0, 1e-8);
  // Nothing came there before.
  for (int i = 0; i < 1000; ++i) {
    const double t = impact->time_s * i / 1000.0;
    EXPECT_GT(-2.0 * t - 0.5 * std::abs(std::cos(20 * t)) - 1e-3 * std::abs(std::sin(20 * t)),
              -1.0);
  }
}

TEST(TimeOfImpact, BodiesThatPassEachOtherHaveNone) {
  World world;
  const std::uint32_t box = world.add_shape(Box{Vec3(0.1, 0.1, 0.1)});
  world.add_body(box, Vec3(0, 0, 0)).linear_velocity_m_s = Vec3(10, 0, 0);
  world.add_body(box, Vec3(1, 0.21, 0)).linear_velocity_m_s = Vec3(-10, 0, 0);
  const Geometry geometry(world.scene);
  EXPECT_FALSE(time_of_impact(
      {world.scene, geometry, 1.0, BodyId{0}, world.states[0], BodyId{1}, &world.states[1]}));
}

TEST(EventDrivenImpacts, ElasticBoxesThatTumbleIntoEachOtherKeepEnergyAndBothMomenta) {
  World world;
  const std::uint32_t box = world.add_shape(Box{Vec3(0.3, 0.2, 0.1)});
  BodyState& a = world.add_body(box, Vec3(0, 0, 0));
  a.linear_velocity_m_s = Vec3(3, 0, 0);
  a.angular_velocity_rad_s = Vec3(1, 2, 3);
  BodyState& b = world.add_body(box, Vec3(1, 0.1, 0.05));
  b.angular_velocity_rad_s = Vec3(-2, 1, 0.5);
  for (BodyParams& body : world.scene.bodies) body.material = {.friction = 0.0, .restitution = 1.0};
  const Mechanics start = measure(world.scene, world.ids, world.states);
  world.run(60);
  ASSERT_GT(world.counters.impacts, 0u);
  const Mechanics end = measure(world.scene, world.ids, world.states);
  EXPECT_NEAR(end.kinetic_energy_joule / start.kinetic_energy_joule, 1.0, 1e-9);
  EXPECT_LE((end.linear_momentum_newton_s - start.linear_momentum_newton_s).norm(),
            1e-13 * start.linear_momentum_newton_s.norm());
  EXPECT_LE((end.angular_momentum_newton_m_s - start.angular_momentum_newton_m_s).norm(),
            1e-8 * start.angular_momentum_newton_m_s.norm())
      << "the gap at which boxes count as touching, over their width";
}

TEST(EventDrivenImpacts, WhatNeitherBouncesNorIsFastIsNotSearched) {
  World world;
  const std::uint32_t ball = world.add_shape(Sphere{0.1});
  world.add_body(ball, Vec3(0, 0, 0)).linear_velocity_m_s = Vec3(1, 0, 0);
  world.add_body(ball, Vec3(0.5, 0, 0));
  for (BodyParams& body : world.scene.bodies) body.material.restitution = 0.0;
  world.run(60);
  EXPECT_GT(world.counters.normal_rows, 0u);
  EXPECT_EQ(world.counters.impact_searches(), 0u);
}

// A rod on its way to a wall, and when the contacts say that it meets it.
TEST(EventDrivenImpacts, WhatContactsFoundAheadIsNotSearchedAgainAndChangesNothing) {
  World world;
  world.add_static(world.add_shape(Box{Vec3(0.01, 5, 5)}));
  BodyState& rod = world.add_body(world.add_shape(Box{Vec3(0.2, 0.005, 0.005)}), Vec3(-1, 0, 0));
  rod.linear_velocity_m_s = Vec3(100, 0, 0);
  rod.angular_velocity_rad_s = Vec3(0, 3, 49);
  const Geometry geometry(world.scene);
  std::vector<ContactManifold> found = test::contacts_of(world, BodyId{0}, static_id(0));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_GT(found[0].impact_s, 0.0);
  std::vector<AdvanceFault> faults;
  std::vector<BodyState> told = world.states, untold = world.states;
  StageCounters with, without;
  const IslandStep island = whole_step(world.scene, geometry, world.ids, found);
  advance_island(island, told, {world.scratch.solve, with, faults});
  found[0].impact_s = 0.0;
  advance_island(island, untold, {world.scratch.solve, without, faults});
  EXPECT_EQ(digest(world.ids, told), digest(world.ids, untold));
  EXPECT_GT(with.impacts, 0u);
  EXPECT_EQ(with.impacts, without.impacts);
  EXPECT_EQ(with.impact_searches() + 1, without.impact_searches());
}

TEST(EventDrivenImpacts, WhatIsKnockedOffItsRestDoesNotPassAWall) {
  World world;
  world.scene.gravity_m_s2 = Vec3(0, 0, -kGravity);
  world.add_floor();
  const std::uint32_t wall = world.add_shape(Box{Vec3(0.05, 4, 4)});
  world.add_static(wall, Vec3(0.5, 0, 2));
  world.add_body(world.add_shape(Box{Vec3(0.1, 0.1, 0.1)}), Vec3(0, 0, 0.1));
  BodyState& bullet = world.add_body(world.add_shape(Sphere{0.1}), Vec3(-0.25, 0, 0.1));
  bullet.linear_velocity_m_s = Vec3(200, 0, 0);
  for (int step = 0; step < 30; ++step) {
    world.run(1);
    EXPECT_LT(world.states[0].position_m.x(), 0.5) << "step " << step;
    EXPECT_LT(world.states[1].position_m.x(), 0.5) << "step " << step;
  }
  EXPECT_GT(world.counters.impact_searches(), 0u);
}

// Eggs in a tray that is shaken. A body that rolls falls onto each facet, more slowly than what
// bounces: 160 hits a step were looked for, 27 ms for nine eggs.
TEST(EventDrivenImpacts, WhatRollsOnWhatMovesIsNotHitFacetByFacet) {
  World world;
  world.scene.gravity_m_s2 = Vec3(0, 0, -kGravity);
  std::vector<Vec3> points;
  for (int i = 0; i < 40; ++i) {
    const double height = 1.0 - 2.0 * (i + 0.5) / 40, turn = 2.399963 * i;
    const double radius_m = 0.13 * std::sqrt(1.0 - height * height);
    points.push_back(Vec3(radius_m * std::cos(turn), radius_m * std::sin(turn),
                          0.13 * height * (height > 0.0 ? 1.25 : 1.0)));
  }
  const Material material{.friction = 0.4, .restitution = 0.1};
  BodyState& tray = world.add_body(world.add_shape(Box{Vec3(2, 2, 0.1)}), Vec3(0, 0, -0.1));
  tray.linear_velocity_m_s = Vec3(1.2, 0.5, 0.5);
  const std::uint32_t shape = world.add_shape(std::get<ConvexHull>(make_convex_hull(points)));
  for (int i = 0; i < 9; ++i)
    world.add_body(shape, Vec3(0.4 * (i % 3), 0.4 * (i / 3), 0.15), 1000.0, material);
  BodyParams& tray_params = world.scene.bodies[0];
  tray_params.kinematic = true;
  tray_params.inverse_inertia_local = Mat3::Zero();
  tray_params.material = material;
  std::uint64_t most = 0;
  for (int step = 0; step < 60; ++step) {
    const std::uint64_t before = world.counters.impact_searches();
    world.run(1);
    most = std::max(most, world.counters.impact_searches() - before);
  }
  EXPECT_LE(most, 40u);
}

}  // namespace
}  // namespace soda::physics
