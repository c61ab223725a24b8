// How bodies of several parts, and with a displaced centre of mass, move among others.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "physics/continuous/time_of_impact.hpp"
#include "tests/physics/compounds.hpp"

namespace soda::physics::test {
namespace {

// Of rods with balls, boxes or hulls at their ends: how far the farthest part's centre ever comes
// beyond a wall whose front is at x = 0.
double deepest_at_wall(const Shape& end, const Shape& wall, double speed_m_s, double dt_s,
                       int kind) {
  World world;
  world.scene.dt_s = dt_s;
  const Material bouncy{.friction = 0.3, .restitution = kind % 2 == 0 ? 0.6 : 0.0};
  const std::uint32_t ball = world.add_shape(end), rod = world.add_shape(Capsule{0.02, 0.6});
  const Compound shape{{{ball, Vec3(0, 0, -0.3), Quat::Identity()},
                        {rod, Vec3::Zero(), Quat::Identity()},
                        {ball, Vec3(0, 0, 0.3), Quat::Identity()}}};
  BodyState& body =
      world.add_body(world.add_shape(shape), Vec3(-1.5 - 0.1 * kind, 0, 0), 1000.0, bouncy);
  body.orientation = about(Vec3(0.2 * kind, 1, 0.1), 0.5 * kind);
  body.linear_velocity_m_s = Vec3(speed_m_s, 0, 0);
  body.angular_velocity_rad_s = Vec3(2.0, 1.5 * kind, 0.5 * kind);
  world.add_static(world.add_shape(wall),
                   Vec3(std::holds_alternative<Box>(wall) ? 0.005 : 0.0, 0, 0), Quat::Identity(),
                   bouncy);
  double deepest = -1e300;
  const int steps = static_cast<int>(std::ceil(std::min(4.0 / speed_m_s, 1.0) / dt_s)) + 10;
  for (int i = 0; i < steps; ++i) {
    world.run(1);
    for (const CompoundPart& part : shape.parts)
      deepest = std::max(
          deepest,
          (world.states[0].position_m + world.states[0].orientation * part.position_m).x());
  }
  return deepest;
}

TEST(CompoundImpacts, NothingPassesThroughAWall) {
  const TriangleMesh sheet{{{0, -5, -5}, {0, 5, -5}, {0, 5, 5}, {0, -5, 5}},
                           {{0, 2, 1}, {0, 3, 2}}};
  const std::vector<Shape> ends{Sphere{0.1}, Box{Vec3(0.1, 0.05, 0.08)}, Cylinder{0.1, 0.1}};
  const std::vector<Shape> walls{Box{Vec3(0.005, 5, 5)}, HalfSpace{-Vec3::UnitX(), 0.0}, sheet};
  for (const Shape& end : ends)
    for (const Shape& wall : walls)
      for (const double speed : {1.0, 10.0, 50.0, 300.0})
        for (const double dt : {1.0 / 30, 1.0 / 240})
          for (int kind = 0; kind < 6; ++kind)
            EXPECT_LT(deepest_at_wall(end, wall, speed, dt, kind), 0.0)
                << end.index() << " at " << wall.index() << ", " << speed << " m/s, dt " << dt
                << ", " << kind;
}

// The first moment at which sampled poses touch.
TEST(CompoundImpacts, TheTimeIsThatAtWhichTheFirstPartTouches) {
  World world;
  const Compound two = dumbbell(world, 0.1, 0.4);
  const std::uint32_t shape = world.add_shape(two);
  world.add_static(world.add_shape(Box{Vec3(0.05, 2, 2)}), Vec3(2, 0, 0));
  for (int i = 0; i < 20; ++i) {
    World one = world;
    one.add_body(shape, Vec3::Zero());
    const double angular_speed = 0.7 * i;
    one.states[0].orientation = about(Vec3::UnitY(), 0.3 * i);
    one.states[0].angular_velocity_rad_s = Vec3(0, angular_speed, 0);
    one.states[0].linear_velocity_m_s = Vec3(5, 0, 0);
    const Geometry geometry(one.scene);
    const auto impact =
        time_of_impact({one.scene, geometry, 1.0, BodyId{0}, one.states[0], static_id(0), nullptr});
    ASSERT_TRUE(impact);
    // The nearer ball's front is at 5 t + .4 |sin| + .1.
    const auto gap = [&](double t) {
      return 1.95 - 5 * t - 0.4 * std::abs(std::sin(0.3 * i + angular_speed * t)) - 0.1;
    };
    EXPECT_NEAR(gap(impact->time_s), 0.0, 1e-9) << i;
    for (int k = 0; k < 1000; ++k) EXPECT_GT(gap(impact->time_s * k / 1000.0), -1e-9);
  }
}

// A ball whose centre of mass lies below its middle; its own frame is about the centre of mass.
World roly_poly(double radius_m, double below_m, double tilt_rad) {
  World world = under_gravity();
  const Material rough{.friction = 2.0};
  const std::uint32_t ball = world.add_shape(Sphere{radius_m});
  const Quat rotation = about(Vec3::UnitY(), tilt_rad);
  BodyState& state =
      world.add_body(world.add_shape(Compound{{{ball, Vec3(0, 0, below_m), Quat::Identity()}}}),
                     Vec3(0, 0, radius_m) - rotation * Vec3(0, 0, below_m), 1000.0, rough);
  state.orientation = rotation;
  world.add_floor(rough);
  return world;
}

TEST(DisplacedCentre, ARolyPolySwingsAsItShould) {
  for (const double below : {0.05, 0.1, 0.3}) {
    const double radius = 0.5;
    World world = roly_poly(radius, below, 0.01);
    world.scene.dt_s = 1.0 / 240;
    const BodyParams& body = world.scene.bodies[0];
    const double about_contact =
        body.inertia_local_kg_m2(1, 1) + body.mass_kg * (radius - below) * (radius - below);
    const double period =
        2 * std::numbers::pi * std::sqrt(about_contact / (body.mass_kg * kGravity * below));
    // Upwards crossings of the angular velocity.
    std::vector<double> crossings;
    double before = 0.0;
    for (int i = 1; crossings.size() < 4 && i < 240 * 40; ++i) {
      world.run(1);
      const double now = world.states[0].angular_velocity_rad_s.y();
      if (before < 0.0 && now >= 0.0)
        crossings.push_back((i - now / (now - before)) * world.scene.dt_s);
      before = now;
    }
    ASSERT_EQ(crossings.size(), 4u);
    EXPECT_NEAR((crossings[3] - crossings[0]) / 3.0, period, 1e-3 * period) << below;
  }
}

TEST(DisplacedCentre, ARolyPolyRightsItself) {
  World world = roly_poly(0.5, 0.2, 2.5);
  world.scene.forces.push_back({.angular_damping_1_s = 1.0});
  world.scene.bodies[0].forces = 0;
  world.run(60 * 30);
  EXPECT_GT((world.states[0].orientation * Vec3::UnitZ()).z(), 0.9999);
  EXPECT_NEAR(world.states[0].position_m.z(), 0.3, 1e-4);
}

// Tables dropped by a little stand on all four legs.
void expect_stands(World& world, const Vec3& up_m, double size) {
  const Quat start = world.states[0].orientation;
  world.run(240);
  EXPECT_LT(world.states[0].linear_velocity_m_s.norm(), 1e-3 * size);
  EXPECT_LT((world.states[0].position_m - up_m).norm(), 2e-2 * size);
  EXPECT_LT(world.states[0].orientation.angularDistance(start), 1e-2);
}

TEST(Tables, StandOnFloorsBoxesAndMeshes) {
  for (const double size : {0.01, 1.0, 100.0})
    for (int ground = 0; ground < 3; ++ground) {
      World world = under_gravity();
      const std::uint32_t shape = world.add_shape(table(world, size));
      const double height =
          -tight_aabb(compile(world.scene.shapes[shape], world.scene.shapes), {}).min.z();
      world.add_body(shape, Vec3(0, 0, 1.001 * height));
      const double s = 5 * size;
      const TriangleMesh sheet{{{-s, -s, 0}, {s, -s, 0}, {s, s, 0}, {-s, s, 0}},
                               {{0, 1, 2}, {0, 2, 3}}};
      if (ground == 0) world.add_floor();
      if (ground == 1) world.add_static(world.add_shape(Box{Vec3::Constant(s)}), Vec3(0, 0, -s));
      if (ground == 2) world.add_static(world.add_shape(sheet));
      SCOPED_TRACE(testing::Message() << size << " m, ground " << ground);
      expect_stands(world, Vec3(0, 0, height), size);
      EXPECT_GE(contacts_of(world, BodyId{0}, static_id(0)).size(), ground == 2 ? 4u : 4u);
    }
}

TEST(Tables, StandOnEachOther) {
  World world = under_gravity();
  const std::uint32_t shape = world.add_shape(table(world, 1.0));
  const Aabb box = tight_aabb(compile(world.scene.shapes[shape], world.scene.shapes), {});
  const double tall = box.max.z() - box.min.z();
  for (int i = 0; i < 3; ++i) world.add_body(shape, Vec3(0, 0, -box.min.z() + i * tall));
  world.add_floor();
  world.run(300);
  for (int i = 0; i < 3; ++i) {
    EXPECT_LT((world.states[i].position_m - Vec3(0, 0, -box.min.z() + i * tall)).norm(), 5e-3);
    EXPECT_LT(world.states[i].linear_velocity_m_s.norm(), 1e-6);
  }
}

TEST(Tables, AreStaticsToo) {
  World world = under_gravity();
  const std::uint32_t shape = world.add_shape(table(world, 1.0));
  const double top = tight_aabb(compile(world.scene.shapes[shape], world.scene.shapes), {}).max.z();
  world.add_body(world.add_shape(Box{Vec3::Constant(0.1)}), Vec3(0.1, 0.1, top + 0.1));
  // Below the plate, between the legs: it falls through.
  world.add_body(world.add_shape(Sphere{0.1}), Vec3(0.1, 0.0, top - 0.25));
  world.add_static(shape);
  world.run(60);
  EXPECT_NEAR(world.states[0].position_m.z(), top + 0.1, 1e-4);
  EXPECT_NEAR(world.states[1].position_m.z(), top - 0.25 - 0.5 * kGravity, 0.1);
}

// What is thrown at a static table at speed meets its legs.
TEST(Tables, LegsStopWhatFlies) {
  for (const double speed : {3.0, 30.0, 300.0}) {
    World world;
    const std::uint32_t shape = world.add_shape(table(world, 1.0));
    const Aabb box = tight_aabb(compile(world.scene.shapes[shape], world.scene.shapes), {});
    world.add_body(world.add_shape(Sphere{0.05}), Vec3(-2, 0.44, box.min.z() + 0.2));
    world.states[0].linear_velocity_m_s = Vec3(speed, 0, 0);
    world.add_static(shape);
    world.run(static_cast<int>(6.0 / speed * 60) + 5);
    EXPECT_LT(world.states[0].position_m.x(), -0.44) << speed;
  }
}

}  // namespace
}  // namespace soda::physics::test
