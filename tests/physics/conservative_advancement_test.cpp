// How long solids in flight cannot touch.
#include "physics/continuous/conservative_advancement.hpp"

#include <gtest/gtest.h>

#include <iostream>
#include <random>

#include "physics/continuous/time_of_impact.hpp"
#include "physics/math/rigid_motion.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::World;

double between(double low, double high, std::mt19937_64& engine) {
  return low + (high - low) * (static_cast<double>(engine() >> 11) * 0x1p-53);
}
Vec3 random_vector(double size, std::mt19937_64& engine) {
  const double x = between(-size, size, engine), y = between(-size, size, engine);
  return {x, y, between(-size, size, engine)};
}

void rotate_at_random(double most_angular_speed_rad_s, BodyState& state, std::mt19937_64& engine) {
  const Vec3 v = random_vector(1.0, engine);
  state.orientation = Quat(between(-1.0, 1.0, engine), v.x(), v.y(), v.z()).normalized();
  state.angular_velocity_rad_s = random_vector(most_angular_speed_rad_s, engine);
}

// Slender, flat, symmetric and not, one with edges that no axis is along.
Shape random_shape(std::mt19937_64& engine) {
  const double thin = between(0.005, 0.05, engine), wide = between(0.02, 0.2, engine);
  switch (engine() % 5) {
    case 0:
      return Box{Vec3(thin, wide, between(0.02, 0.2, engine))};
    case 1:
      return Box{Vec3(0.2, thin, thin)};
    case 2:
      return Capsule{thin, 0.2};
    case 3:
      return Cylinder{wide, thin};
    default: {
      const std::vector<Vec3> corners{{wide, 0, 0},  {-wide, 0, 0.01}, {0, wide, 0.02},
                                      {0, -wide, 0}, {0, 0, thin},     {0, 0.03, -thin}};
      return std::get<ConvexHull>(make_convex_hull(corners));
    }
  }
}

// An angular velocity mostly about one axis of the body now and then.
void rotate_at_random(BodyState& state, std::mt19937_64& engine) {
  rotate_at_random(30.0, state, engine);
  if (engine() % 2 == 0)
    state.angular_velocity_rad_s +=
        state.orientation * (Vec3::Unit(static_cast<int>(engine() % 3)) * 1000.0);
}

TEST(AngularVelocityBounds, HoldAtAnyTimeOfAFreeFlight) {
  std::mt19937_64 engine(11);
  for (int i = 0; i < 300; ++i) {
    World world;
    BodyState& state = world.add_body(world.add_shape(random_shape(engine)), Vec3::Zero());
    rotate_at_random(state, engine);
    const Geometry geometry(world.scene);
    const BodyParams& params = world.scene.bodies[0];
    const CompiledShape& shape = geometry.impl().shapes[0].shape;
    const AngularVelocityBounds most = angular_velocity_bounds(
        params, shape, state.orientation.toRotationMatrix(), state.angular_velocity_rad_s);
    for (int k = 0; k < 200; ++k) {
      rotate_freely(params, between(0.0, 0.01, engine), state);
      const Mat3 rotation = state.orientation.toRotationMatrix();
      const Vec3 angular_velocity = rotation.transpose() * state.angular_velocity_rad_s;
      const Vec3 change = params.inverse_inertia_local *
                          (params.inertia_local_kg_m2 * angular_velocity).cross(angular_velocity);
      const double close = 1.0 + 1e-9;
      ASSERT_LE(angular_velocity.norm(), most.angular_speed_rad_s * close) << i;
      ASSERT_LE(change.norm(), most.change_rad_s2 * close + 1e-9) << i;
      const Vec3 r = support(shape, random_vector(1.0, engine));
      ASSERT_LE(angular_velocity.cross(r).norm(), most.speed_m_s * close) << i;
      ASSERT_LE(change.cross(r).norm(), most.change_m_s2 * close + 1e-9) << i;
      ASSERT_LE((angular_velocity.cross(angular_velocity.cross(r)) + change.cross(r)).norm(),
                most.pull_m_s2 * close)
          << i;
    }
  }
}

// Two solids that are apart and fly about near each other.
World random_flight(const Shape& a, const Shape& b, std::mt19937_64& engine) {
  World world;
  world.scene.gravity_m_s2 = Vec3(0, 0, -9.81);
  for (const Shape& shape : {a, b}) {
    BodyState& state = world.add_body(world.add_shape(shape), random_vector(0.3, engine));
    rotate_at_random(state, engine);
    state.linear_velocity_m_s = random_vector(20.0, engine);
  }
  return world;
}

TEST(FlyingSolids, DoNotTouchBeforeTheTimeThatTheyArePromisedToBeApart) {
  constexpr double kMost_s = 0.02;
  std::mt19937_64 engine(5);
  int with_body = 0, with_edges = 0, flights = 0;
  for (int i = 0; i < 10000; ++i) {
    World world = random_flight(random_shape(engine), random_shape(engine), engine);
    const bool fixed = i % 3 == 0;
    world.add_static(1, world.states[1].position_m, world.states[1].orientation);
    const Geometry geometry(world.scene);
    FlyingSolids solids(PairStep{world.scene, geometry, kMost_s, BodyId{0}, world.states[0],
                                 fixed ? static_id(0) : BodyId{1},
                                 fixed ? nullptr : &world.states[1]});
    solids.bound_turning();
    const Solid &a = solids.a().solid, &b = solids.b().solid;
    const Separation now = separation_between(a, b, b.placed.pose.position.normalized());
    if (!(now.distance_m > 0.0)) continue;
    ++flights;
    const FlyingSolids::Wait wait = solids.apart_s(now, 0.0, kMost_s);
    with_body += wait.with != nullptr;
    with_edges += wait.drift_1_s != Vec3::Zero();
    ASSERT_GT(wait.time_s, 0.0);
    for (int k = 1; k <= 50; ++k) {
      solids.go_to(wait.time_s * k / 50.0);
      const Separation then = separation_between(a, b, b.placed.pose.position.normalized());
      ASSERT_GE(then.distance_m, -1e-12)
          << "flight " << i << ", " << k << " fiftieths of " << wait.time_s << " s";
    }
  }
  EXPECT_GT(flights, 5000);
  EXPECT_GT(with_body, 100);
  EXPECT_GT(with_edges, 100);
}

// Two thin rods that cross while both turn, the second at `height_m` above the first.
World crossing_rods(double height_m, std::mt19937_64& engine) {
  World world;
  const std::uint32_t rod = world.add_shape(Box{Vec3(0.2, 0.005, 0.005)});
  world.add_body(rod, Vec3::Zero()).angular_velocity_rad_s = random_vector(40.0, engine);
  BodyState& above = world.add_body(rod, Vec3(0, 0, height_m));
  above.orientation = Quat(std::sqrt(0.5), 0, 0, std::sqrt(0.5));
  above.angular_velocity_rad_s = random_vector(40.0, engine);
  above.linear_velocity_m_s = Vec3(0, 0, -10);
  return world;
}

// Where ends of edges came nearer at first order, each look left a fixed share of the distance.
TEST(FlyingSolids, ThatMeetWithTheirEdgesAreFollowedToTheirImpactInAFewLooks) {
  std::mt19937_64 engine(3);
  int looks = 0, met = 0;
  for (int i = 0; i < 100; ++i) {
    World world = crossing_rods(0.05, engine);
    const Geometry geometry(world.scene);
    FlyingSolids solids(PairStep{world.scene, geometry, 1.0, BodyId{0}, world.states[0], BodyId{1},
                                 &world.states[1]});
    solids.bound_turning();
    double time = 0.0;
    for (int look = 1; look < 100; ++look) {
      solids.go_to(time);
      const Separation now = separation_between(solids.a().solid, solids.b().solid, Vec3::UnitZ());
      if (now.distance_m <= 1e-10) {
        ++met;
        looks += look;
        break;
      }
      time += solids.apart_s(now, 0.0, 0.02 - time).time_s;
      if (time >= 0.02) break;
    }
  }
  EXPECT_GT(met, 60);
  EXPECT_LT(looks, 8 * met);
  std::cout << looks << " looks for " << met << " impacts\n";
}

}  // namespace
}  // namespace soda::physics
