// What lies across something narrower or longer than itself: an edge of one is over a face of the
// other, and holds it with both ends of what they share.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::World;

struct Support {
  std::string name;
  Shape shape;
  double top_m;  // above its origin
  Quat orientation = Quat::Identity();
};

// Ridges along y, longer than what lies on them, of the width `w`.
std::vector<Support> ridges(double w) {
  const double half = 0.5 * w, quarter_turn = 0.5 * 3.14159265358979;
  const Quat along_y = test::about(Vec3::UnitX(), quarter_turn);
  TriangleMesh roof;
  for (const double x : {0.0, -w, w})
    for (const double y : {-3 * half, 3 * half})
      roof.vertices_m.push_back(Vec3(x, y, -std::abs(x)));
  roof.triangles = {{0, 1, 2}, {1, 3, 2}, {1, 0, 4}, {1, 4, 5}};
  return {{"cylinder", Cylinder{half, 3 * w}, half, along_y},
          {"capsule", Capsule{half, 3 * w}, half, along_y},
          {"edge", Box{Vec3(half, 3 * half, half)}, half * std::sqrt(2.0),
           test::about(Vec3::UnitY(), 0.5 * quarter_turn)},
          {"beam", Box{Vec3(0.3 * half, 3 * half, 0.3 * half)}, 0.3 * half},
          {"roof", roof, 0.0}};
}

World on(const Support& support, const Vec3& half_extents_m, double gap_m, Material material = {}) {
  World world = test::under_gravity();
  world.add_body(world.add_shape(Box{half_extents_m}), Vec3(0, 0, half_extents_m.z() + gap_m),
                 500.0, material);
  world.add_static(world.add_shape(support.shape), Vec3(0, 0, -support.top_m), support.orientation,
                   material);
  return world;
}

TEST(RestingAcross, ATiltedPlankTouchesWithBothEndsOfItsWidth) {
  for (const Support& support : ridges(1.0))
    for (const double tilt : {1e-6, 1e-3, 0.02, 0.1, -0.15}) {
      World world = on(support, Vec3(1.5, 0.25, 0.05), 0.0);
      const double drop_m = 0.25 * std::sin(std::abs(tilt)) - 0.05 * (1.0 - std::cos(tilt));
      world.states[0].position_m.z() += drop_m + 1e-3;
      world.states[0].orientation = test::about(Vec3::UnitX(), tilt);
      world.states[0].linear_velocity_m_s = Vec3(0, 0, -20);
      double least = 1e300, most = -1e300;
      for (const ContactManifold& m : test::contacts_of(world, BodyId{0}, static_id(0)))
        for (std::uint32_t i = 0; i < m.count; ++i) {
          least = std::min(least, m.points[i].separation_m);
          most = std::max(most, m.points[i].separation_m);
        }
      EXPECT_NEAR(least, 1e-3, 1e-9) << support.name << " " << tilt;
      EXPECT_NEAR(most - least, 0.5 * std::sin(std::abs(tilt)), 0.03 * std::abs(tilt) + 1e-9)
          << support.name << " " << tilt;
    }
}

double deepest_m(World& world, double time_s) {
  const Geometry geometry(world.scene);
  double deepest = 0.0;
  for (int i = 0; i < time_s / world.scene.dt_s; ++i) {
    world.run(1, geometry);
    for (const IslandReport& island : world.report.islands)
      deepest = std::max(deepest, island.max_penetration_m);
  }
  return deepest;
}

// From end to end, faster and faster: with one end alone in a step, the other one sank in by as
// much as it came far.
TEST(RestingAcross, APlankThatRocksDoesNotSinkIn) {
  for (const double w : {0.05, 0.2, 1.0})
    for (const Support& support : ridges(w))
      for (const double dt : {1.0 / 60, 1.0 / 240})
        for (const double restitution : {0.0, 0.3, 0.7})
          for (const double length : {0.4, 4.0}) {
            World world = on(support, Vec3(0.5 * length * w, 0.5 * w, 0.1 * w), 0.02 * w,
                             {.friction = 0.5, .restitution = restitution});
            world.scene.dt_s = dt;
            const double speed = std::sqrt(test::kGravity * w);
            world.states[0].linear_velocity_m_s = Vec3(0, 0, -0.1 * speed);
            world.states[0].angular_velocity_rad_s = Vec3(0.6 * speed / w, 0.1 * speed / w, 0);
            EXPECT_LT(deepest_m(world, 1.0), 3e-3 * w)
                << support.name << " " << w << " " << dt << " " << restitution << " " << length;
          }
}

}  // namespace
}  // namespace soda::physics
