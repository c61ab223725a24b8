// States that only speculation can produce: nothing may throw, hang or give NaN.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::World;

bool all_finite(const World& world) {
  for (const BodyState& s : world.states) {
    if (!s.position_m.allFinite() || !s.linear_velocity_m_s.allFinite() ||
        !s.angular_velocity_rad_s.allFinite() || !s.orientation.coeffs().allFinite()) {
      return false;
    }
    for (const ContactImpulse& i : s.impulses) {
      if (!std::isfinite(i.normal_newton_s) || !i.friction_newton_s.allFinite()) return false;
    }
  }
  return true;
}

World one_of_each() {
  World world = test::under_gravity();
  std::vector<Vec3> points;
  for (int i = 0; i < 8; ++i)
    points.push_back(Vec3(i & 1, i >> 1 & 1, i >> 2 & 1) - Vec3(.5, .5, .5));
  world.scene.shapes = {Sphere{0.5}, Box{}, Capsule{0.3, 0.4}, Cylinder{0.5, 1.0},
                        std::get<ConvexHull>(make_convex_hull(points))};
  return world;
}

TEST(Speculation, BodiesInOnePlaceStayFiniteAndComeApart) {
  for (std::uint32_t shape = 0; shape < 5; ++shape) {
    World world = one_of_each();
    world.scene.gravity_m_s2 = Vec3::Zero();
    for (int i = 0; i < 4; ++i) world.add_body(shape, Vec3(1, 2, 3));
    world.run(300);
    EXPECT_TRUE(all_finite(world)) << "shape " << shape;
    EXPECT_TRUE(world.report.faults.empty());
    double fastest = 0.0;
    for (const BodyState& s : world.states)
      fastest = std::max(fastest, s.linear_velocity_m_s.norm());
    EXPECT_LT(fastest, 1.0) << "shape " << shape << ": no pop";
    EXPECT_GT((world.states[0].position_m - world.states[3].position_m).norm(), 0.4)
        << "shape " << shape;
  }
}

TEST(Speculation, MixedSolidsInOnePlaceAmongStaticsStayFinite) {
  World world = one_of_each();
  world.add_floor();
  TriangleMesh mesh;
  mesh.vertices_m = {{-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  world.add_static(world.add_shape(mesh));
  world.add_static(1);  // a box
  for (std::uint32_t i = 0; i < 15; ++i) world.add_body(i % 5, Vec3(0, 0, 0.1));
  world.run(120);
  EXPECT_TRUE(all_finite(world));
}

TEST(Speculation, AbsurdVelocitiesGiveAFaultAndTheOldState) {
  for (const double v : {1e10, 1e100, 1e300}) {
    World world = one_of_each();
    world.add_floor();
    for (std::uint32_t i = 0; i < 5; ++i) {
      BodyState& s = world.add_body(i, Vec3(3.0 * i, 0, 0.5));
      s.linear_velocity_m_s = Vec3(v, -v, -v);
      s.angular_velocity_rad_s = Vec3(0, v, 0);
    }
    const std::vector<BodyState> before = world.states;
    world.run(1);
    EXPECT_EQ(world.report.faults.size(), 5u) << v;
    for (const AdvanceFault& fault : world.report.faults) EXPECT_FALSE(fault.what.empty());
    for (std::size_t i = 0; i < before.size(); ++i) {
      EXPECT_TRUE(identical(world.states[i], before[i])) << v;
    }
  }
}

TEST(Speculation, NonFiniteStatesGiveAFault) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  for (const double bad : {nan, inf, -inf}) {
    World world = one_of_each();
    world.add_floor();
    for (std::uint32_t i = 0; i < 5; ++i) world.add_body(i, Vec3(2.0 * i, 0, 0.4));
    world.states[1].position_m.x() = bad;
    world.states[2].linear_velocity_m_s.y() = bad;
    world.run(1);
    std::vector<std::uint32_t> faulty;
    for (const AdvanceFault& f : world.report.faults) faulty.push_back(index_of(f.body));
    std::sort(faulty.begin(), faulty.end());
    EXPECT_EQ(faulty, (std::vector<std::uint32_t>{1, 2})) << bad;
    EXPECT_TRUE(world.states[0].position_m.allFinite());
  }
}

TEST(Speculation, RandomDeepOverlapsOfAllPairsStayFinite) {
  std::mt19937_64 random(1);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53 - 0.5; };
  for (int trial = 0; trial < 300; ++trial) {
    World world = one_of_each();
    const double scale = std::pow(10.0, 6.0 * unit());
    for (int i = 0; i < 6; ++i) {
      const Vec3 at(unit(), unit(), unit());
      BodyState& s = world.add_body(random() % 5, at);
      s.linear_velocity_m_s = scale * Vec3(unit(), unit(), unit());
      s.angular_velocity_rad_s = scale * Vec3(unit(), unit(), unit());
      s.orientation = test::about(Vec3(unit(), unit(), unit()), 6 * unit());
    }
    world.run(3);
    ASSERT_TRUE(all_finite(world)) << "trial " << trial;
  }
}

TEST(Speculation, ExtremeMassesAndInertiasStayFinite) {
  World world = test::under_gravity();
  world.add_floor();
  const std::uint32_t needle = world.add_shape(Box{Vec3(1e-3, 1e-3, 1.0)});
  const std::uint32_t plate = world.add_shape(Box{Vec3(1.0, 1.0, 1e-3)});
  for (int i = 0; i < 6; ++i) {
    world
        .add_body(i % 2 ? needle : plate, Vec3(0.1 * i, 0, 0.5 + 0.3 * i),
                  std::pow(10.0, 3.0 * i - 6.0))
        .angular_velocity_rad_s = Vec3(1, 2, 3);
  }
  world.run(300);
  EXPECT_TRUE(all_finite(world));
  EXPECT_TRUE(world.report.faults.empty());
}

}  // namespace
}  // namespace soda::physics
