// Rolling and torsional friction: closed forms of what they stop, hold and leave alone.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/physics/joints.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::kGravity;
using test::World;

Material rough(double friction, double rolling_m, double torsional_m = 0.0) {
  return {friction, 0.0, rolling_m, torsional_m};
}

// A halfspace through the origin, whose downward direction is x turned about y.
struct Plane {
  World world = test::under_gravity();
  double angle_rad;
  Vec3 down, normal;
  Plane(double slope, const Material& material) : angle_rad(std::atan(slope)) {
    down = Vec3(std::cos(angle_rad), 0, -std::sin(angle_rad));
    normal = Vec3(std::sin(angle_rad), 0, std::cos(angle_rad));
    world.add_static(world.add_shape(HalfSpace{normal, 0.0}), Vec3::Zero(), Quat::Identity(),
                     material);
  }
  BodyState& add_ball(double radius, const Material& material, double density = 1000.0) {
    return world.add_body(world.add_shape(Sphere{radius}), normal * radius, density, material);
  }
  // Rolls down without slip.
  void roll(double speed, double radius, BodyState& ball) const {
    ball.linear_velocity_m_s = down * speed;
    ball.angular_velocity_rad_s = normal.cross(down) * (speed / radius);
  }
};

// (m + I / R^2) a = -rolling m g / R, so a ball slows by 5/7 g rolling / R.
TEST(RollingFriction, StopsABallOnALevelFloorWhereTheClosedFormSaysAndItStays) {
  for (const double radius : {0.03, 0.5, 4.0})
    for (const double share : {0.01, 0.2, 0.6})
      for (const double dt_s : {1.0 / 240.0, 1.0 / 60.0, 1.0 / 30.0})
        for (const double density : {10.0, 8000.0}) {
          Plane plane(0.0, rough(0.5, share * radius));
          plane.world.scene.dt_s = dt_s;
          BodyState& ball = plane.add_ball(radius, rough(0.5, 0.0), density);
          const double slowed = 5.0 / 7.0 * kGravity * share, stop_s = 0.7;
          plane.roll(slowed * stop_s, radius, ball);
          plane.world.run(static_cast<int>(std::lround(1.0 / dt_s)));
          const double displacement = 0.5 * slowed * stop_s * stop_s;
          const BodyState end = plane.world.states[0];
          EXPECT_NEAR(end.position_m.x(), displacement, 1e-9 * displacement + 1e-12)
              << radius << share << dt_s;
          EXPECT_EQ(end.linear_velocity_m_s, Vec3(Vec3::Zero())) << radius << share << dt_s;
          EXPECT_EQ(end.angular_velocity_rad_s, Vec3(Vec3::Zero())) << radius << share << dt_s;
          plane.world.run(60);
          EXPECT_EQ(plane.world.states[0].position_m, end.position_m);
          EXPECT_EQ(plane.world.report.islands[0].rests, true);
        }
}

TEST(RollingFriction, HoldsABallOnASlopeUpToItsCoefficientOverTheRadius) {
  for (const double radius : {0.05, 1.0})
    for (const double slope : {0.01, 0.1, 0.4})
      for (const double dt_s : {1.0 / 240.0, 1.0 / 30.0}) {
        Plane plane(slope, rough(1.0, 1.0001 * slope * radius));
        plane.world.scene.dt_s = dt_s;
        plane.add_ball(radius, rough(1.0, 0.0));
        const Vec3 start = plane.world.states[0].position_m;
        plane.world.run(static_cast<int>(std::lround(20.0 / dt_s)));
        EXPECT_LT((plane.world.states[0].position_m - start).norm(), 1e-12 * radius)
            << radius << " " << slope << " " << dt_s;
        EXPECT_TRUE(plane.world.report.islands[0].rests);
      }
}

// Beyond that it rolls: 5/7 g (sin - rolling / R cos).
TEST(RollingFriction, LetsABallRollDownASteeperSlopeAsTheClosedFormSays) {
  for (const double radius : {0.05, 1.0})
    for (const double share : {0.0, 0.5, 0.9})
      for (const double dt_s : {1.0 / 240.0, 1.0 / 30.0}) {
        const double slope = 0.3;
        Plane plane(slope, rough(1.0, share * slope * radius));
        plane.world.scene.dt_s = dt_s;
        plane.add_ball(radius, rough(1.0, 0.0));
        const Vec3 start = plane.world.states[0].position_m;
        plane.world.run(static_cast<int>(std::lround(2.0 / dt_s)));
        const double a = 5.0 / 7.0 * kGravity * std::sin(plane.angle_rad) * (1.0 - share);
        const double displacement = (plane.world.states[0].position_m - start).dot(plane.down);
        EXPECT_NEAR(displacement, 2.0 * a, 1e-9) << radius << " " << share << " " << dt_s;
      }
}

// Up, to a stop, and down again: rolling friction turns round within a step.
TEST(RollingFriction, TurnsRoundWithTheBall) {
  for (const double dt_s : {1.0 / 240.0, 1.0 / 60.0, 1.0 / 30.0}) {
    const double slope = 0.3, share = 0.5, radius = 0.4, speed = 3.0;
    Plane plane(slope, rough(1.0, share * slope * radius));
    plane.world.scene.dt_s = dt_s;
    plane.roll(-speed, radius, plane.add_ball(radius, rough(1.0, 0.0)));
    const Vec3 start = plane.world.states[0].position_m;
    plane.world.run(static_cast<int>(std::lround(3.0 / dt_s)));
    const double pull = 5.0 / 7.0 * kGravity * std::sin(plane.angle_rad);
    const double up_s = speed / (pull * (1.0 + share)), down_s = 3.0 - up_s;
    const double displacement = 0.5 * pull * (1.0 - share) * down_s * down_s - 0.5 * speed * up_s;
    EXPECT_NEAR((plane.world.states[0].position_m - start).dot(plane.down), displacement, 1e-7)
        << dt_s;
  }
}

// I w' = -torsional m g, so a ball's rate about the normal falls by 5/2 g torsional / R^2.
TEST(RollingFriction, StopsTheRotationOfABallInTheTimeOfTheClosedForm) {
  for (const double radius : {0.05, 1.0})
    for (const double dt_s : {1.0 / 240.0, 1.0 / 30.0}) {
      const double torsional = 0.01 * radius;
      Plane plane(0.0, rough(0.5, 0.0, torsional));
      plane.world.scene.dt_s = dt_s;
      BodyState& ball = plane.add_ball(radius, rough(0.5, 0.0));
      const double slowed = 2.5 * kGravity * torsional / (radius * radius);
      ball.angular_velocity_rad_s = Vec3(0, 0, slowed);
      plane.world.run(static_cast<int>(std::lround(0.5 / dt_s)));
      EXPECT_NEAR(plane.world.states[0].angular_velocity_rad_s.z(), 0.5 * slowed, 1e-9 * slowed);
      plane.world.run(static_cast<int>(std::lround(0.6 / dt_s)));
      EXPECT_EQ(plane.world.states[0].angular_velocity_rad_s, Vec3(Vec3::Zero()));
    }
}

// Four points bear the box; each has its share of the bound, not all of it.
TEST(RollingFriction, IsNoStrongerWhereManyPointsBearTheBody) {
  const double torsional = 0.02, angular_speed = 3.0;
  Plane plane(0.0, rough(0.0, 0.0, torsional));
  BodyState& box = plane.world.add_body(plane.world.add_shape(Box{Vec3(0.4, 0.3, 0.2)}),
                                        Vec3(0, 0, 0.2), 500.0, rough(0.0, 0.0));
  box.angular_velocity_rad_s = Vec3(0, 0, angular_speed);
  const BodyParams& params = plane.world.scene.bodies[0];
  const double slowed = torsional * params.mass_kg * kGravity / params.inertia_local_kg_m2(2, 2);
  plane.world.run(30);
  ASSERT_EQ(plane.world.report.islands[0].contact_points, 4u);
  EXPECT_NEAR(plane.world.states[0].angular_velocity_rad_s.z(), angular_speed - 0.5 * slowed, 1e-9);
}

// A lying cylinder has two points: (m + I / R^2) a = m g sin - rolling m g cos / R.
TEST(RollingFriction, OfALyingCylinderIsThatOfItsWholeWeight) {
  for (const double share : {0.5, 1.001}) {
    const double slope = 0.2, radius = 0.25;
    Plane plane(slope, rough(1.0, share * slope * radius));
    BodyState& cylinder = plane.world.add_body(plane.world.add_shape(Cylinder{radius, 1.0}),
                                               plane.normal * radius, 700.0, rough(1.0, 0.0));
    cylinder.orientation = test::about(Vec3::UnitX(), M_PI / 2);
    const Vec3 start = cylinder.position_m;
    plane.world.run(120);
    const double a =
        share > 1.0 ? 0.0 : 2.0 / 3.0 * kGravity * std::sin(plane.angle_rad) * (1.0 - share);
    const double displacement = (plane.world.states[0].position_m - start).dot(plane.down);
    EXPECT_NEAR(displacement, 2.0 * a, 1e-6) << share;
  }
}

// n balls that touch, in a line across or down the slope: all stay.
TEST(RollingFriction, HoldsRowsOfBallsThatTouch) {
  for (const int count : {2, 3, 8}) {
    const double slope = 0.1, radius = 0.2;
    Plane plane(slope, rough(0.8, 1.2 * slope * radius));
    for (int i = 0; i < count; ++i)
      plane.add_ball(radius, rough(0.8, 0.0)).position_m += plane.down * (2.0 * radius * i);
    const std::vector<BodyState> start = plane.world.states;
    plane.world.run(1200);
    for (int i = 0; i < count; ++i)
      EXPECT_LT((plane.world.states[i].position_m - start[i].position_m).norm(), 1e-6 * radius)
          << count << " " << i;
  }
}

// A torque impulse of at most torsional times the impulse of the hit.
TEST(RollingFriction, ActsInHitsByTheirImpulse) {
  World world;
  const double restitution = 0.5, torsional = 0.01, radius = 0.3, speed = 2.0, angular_speed = 4.0;
  world.add_floor({0.4, restitution, 0.0, torsional});
  BodyState& ball =
      world.add_body(world.add_shape(Sphere{radius}), Vec3(0, 0, 1), 1000.0, {0.4, restitution});
  ball.linear_velocity_m_s = Vec3(0, 0, -speed);
  ball.angular_velocity_rad_s = Vec3(0, 0, angular_speed);
  world.run(60);
  ASSERT_NEAR(world.states[0].linear_velocity_m_s.z(), restitution * speed, 1e-12);
  const double taken = 2.5 * torsional * (1.0 + restitution) * speed / (radius * radius);
  EXPECT_NEAR(world.states[0].angular_velocity_rad_s.z(), angular_speed - taken, 1e-12);
}

// Two balls that spin and hit each other: what one loses of its angular momentum, the other gets.
TEST(RollingFriction, KeepsMomentaAndGivesNoEnergy) {
  World world;
  const std::uint32_t shape = world.add_shape(Sphere{0.5});
  for (int i = 0; i < 12; ++i) {
    BodyState& ball = world.add_body(shape, Vec3(1.02 * (i % 3), 1.02 * (i / 3), 0.1 * (i % 2)),
                                     1000.0, {0.5, 0.2, 0.05, 0.03});
    ball.linear_velocity_m_s = -0.7 * ball.position_m + Vec3(0.7, 1.0, 0);
    ball.angular_velocity_rad_s = Vec3(3.0 - i, 0.5 * i, 2.0 * (i % 4) - 3.0);
  }
  const Mechanics before = world.mechanics();
  double energy = before.kinetic_energy_joule;
  for (int i = 0; i < 120; ++i) {
    world.run(1);
    const double now = world.mechanics().kinetic_energy_joule;
    ASSERT_LE(now, energy * (1.0 + 1e-12)) << i;
    energy = now;
  }
  const Mechanics after = world.mechanics();
  EXPECT_LT(energy, 0.9 * before.kinetic_energy_joule);
  EXPECT_GT(world.counters.rolling_rows, 0u);
  EXPECT_LT((after.linear_momentum_newton_s - before.linear_momentum_newton_s).norm(), 1e-9);
  EXPECT_LT((after.angular_momentum_newton_m_s - before.angular_momentum_newton_m_s).norm(), 1e-8);
}

// A cart on four wheels: (M + 4 I / R^2) a = M g sin - rolling M g cos / R, or it stays.
TEST(RollingFriction, OfWheelsBrakesTheCartThatJointsHangOnThem) {
  for (const double share : {0.0, 0.5, 1.05})
    for (const double dt_s : {1.0 / 240.0, 1.0 / 60.0}) {
      const double slope = 0.1, radius = 0.2;
      Plane plane(slope, rough(0.9, share * slope * radius));
      World& world = plane.world;
      world.scene.dt_s = dt_s;
      const Quat tilted = test::about(Vec3::UnitY(), plane.angle_rad);
      world.add_body(world.add_shape(Box{Vec3(0.6, 0.2, 0.05)}), plane.normal * 0.22, 300.0)
          .orientation = tilted;
      const std::uint32_t wheel = world.add_shape(Cylinder{radius, 0.08});
      for (const double along : {-0.4, 0.4})
        for (const double across : {-0.3, 0.3})
          world
              .add_body(wheel, plane.down * along + Vec3(0, across, 0) + plane.normal * radius,
                        200.0, rough(0.9, 0.0))
              .orientation = tilted * test::about(Vec3::UnitX(), M_PI / 2);
      for (std::uint32_t i = 1; i <= 4; ++i)
        test::add(world, test::joint_at(JointKind::kHinge, world, 0, i, world.states[i].position_m,
                                        Vec3::UnitY()));
      const std::vector<BodyState> start = world.states;
      world.run(static_cast<int>(std::lround(2.0 / dt_s)));
      const BodyParams& params = world.scene.bodies[1];
      const double mass = world.scene.bodies[0].mass_kg + 4.0 * params.mass_kg;
      const double inert = mass + 4.0 * params.inertia_local_kg_m2(2, 2) / (radius * radius);
      const double a =
          std::max(0.0, mass * kGravity * std::sin(plane.angle_rad) * (1.0 - share) / inert);
      const double displacement =
          (world.states[0].position_m - start[0].position_m).dot(plane.down);
      // Of first order in the step.
      EXPECT_NEAR(displacement, 2.0 * a, 1.5 * a * dt_s + 1e-6) << share << " " << dt_s;
    }
}

// Marbles poured on one place: rolling friction keeps them in a heap, and brings them to rest.
// Without resistance they spread, with it they stay where they are, however they began. Iterations
// get as far as there are iterations: enough of them, and the heap is at rest.
TEST(RollingFriction, KeepsAHeapOfBalls) {
  const auto heap = [](double rolling_m, double shift_m) {
    World world = test::under_gravity();
    world.add_floor(rough(0.6, 0.0));
    const std::uint32_t marble = world.add_shape(Sphere{0.05});
    for (int i = 0; i < 60; ++i)
      world.add_body(marble,
                     Vec3(0.11 * (i % 3 - 1) + 0.003 * (i % 7) + shift_m * (i % 11),
                          0.11 * (i / 3 % 3 - 1) + 0.002 * (i % 5), 0.08 + 0.12 * (i / 9)),
                     2500.0, rough(0.6, rolling_m, rolling_m));
    return world;
  };
  const auto radius_m = [](const World& world) {
    double squared = 0.0;
    for (const BodyState& state : world.states) squared += state.position_m.head<2>().squaredNorm();
    return std::sqrt(squared / 60.0);
  };
  const auto fastest_m_s = [](const World& world) {
    double fastest = 0.0;
    for (const BodyState& state : world.states)
      fastest = std::max(fastest, state.linear_velocity_m_s.norm());
    return fastest;
  };
  World spread = heap(0.0, 0.0);
  spread.run(600);
  for (const double shift_m : {0.0, 1e-4, 2e-4, -1e-4, -2e-4}) {
    World world = heap(0.02, shift_m);
    world.run(600);
    EXPECT_LT(radius_m(world), 0.5 * radius_m(spread)) << "shifted by " << shift_m;
    EXPECT_LE(fastest_m_s(world), shift_m == 0.0 ? 1e-6 : 1e-3) << "shifted by " << shift_m;
    if (shift_m < 0.0 || shift_m > 1e-4) continue;
    World rests = heap(0.02, shift_m);
    rests.scene.solver.iterations = 400;
    rests.run(500);
    int still = 0;
    for (int step = 0; step < 500; ++step) {
      rests.run(1);
      still += fastest_m_s(rests) == 0.0;
      EXPECT_LE(fastest_m_s(rests), 1e-7) << "shifted by " << shift_m << ", step " << step;
    }
    EXPECT_GE(still, 200) << "shifted by " << shift_m;
  }
}

TEST(RollingFriction, MakesNoRowWhereNoMaterialHasIt) {
  Plane plane(0.1, rough(0.5, 0.0));
  plane.add_ball(0.3, rough(0.5, 0.0));
  plane.world.run(30);
  EXPECT_GT(plane.world.counters.friction_rows, 0u);
  EXPECT_EQ(plane.world.counters.rolling_rows, 0u);
}

}  // namespace
}  // namespace soda::physics
