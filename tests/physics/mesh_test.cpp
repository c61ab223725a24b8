#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::World;

struct Random {
  std::mt19937_64 engine;
  double unit() { return static_cast<double>(engine() >> 11) * 0x1p-53; }
  double between(double low, double high) { return low + (high - low) * unit(); }
  Vec3 vector() { return {between(-1, 1), between(-1, 1), between(-1, 1)}; }
  Quat turn() { return Quat(Eigen::Quaterniond(between(-1, 1), between(-1, 1), between(-1, 1), between(-1, 1)).normalized()); }
};

// A grid of triangles around the origin, uneven by up to `uneven_m`.
TriangleMesh grid(int cells, double cell_m, double uneven_m, Random& random) {
  TriangleMesh mesh;
  for (int x = 0; x <= cells; ++x)
    for (int y = 0; y <= cells; ++y)
      mesh.vertices_m.push_back(Vec3((x - 0.5 * cells) * cell_m, (y - 0.5 * cells) * cell_m,
                                     random.between(-uneven_m, uneven_m)));
  for (int x = 0; x < cells; ++x)
    for (int y = 0; y < cells; ++y) {
      const auto v = static_cast<std::uint32_t>(x * (cells + 1) + y), row = static_cast<std::uint32_t>(cells + 1);
      mesh.triangles.push_back({v, v + row, v + row + 1});
      mesh.triangles.push_back({v, v + row + 1, v + 1});
    }
  return mesh;
}

const char* const kNames[] = {"marble", "die", "coin", "pencil", "capsule", "hull"};

// Of about the given size.
Shape solid(int kind, double size_m) {
  switch (kind) {
    case 0:
      return Sphere{0.5 * size_m};
    case 1:
      return Box{Vec3::Constant(0.5 * size_m)};
    case 2:
      return Cylinder{0.5 * size_m, 0.08 * size_m};
    case 3:
      return Cylinder{0.05 * size_m, size_m};
    case 4:
      return Capsule{0.1 * size_m, 0.8 * size_m};
    default: {
      std::vector<Vec3> points;
      for (int i = 0; i < 6; ++i)
        points.push_back(Vec3::Unit(i / 2) * ((i % 2 ? 0.5 : -0.5) * size_m));
      return std::get<ConvexHull>(make_convex_hull(points));
    }
  }
}

int passed_through(int kind, double size_m, double speed_m_s, double dt_s, std::uint64_t seed) {
  Random random{std::mt19937_64(seed)};
  int passed = 0;
  for (int trial = 0; trial < 40; ++trial) {
    World world = test::under_gravity();
    world.scene.dt_s = dt_s;
    const double cell = size_m * random.between(0.3, 3.0);
    world.add_static(world.add_shape(grid(40, cell, trial % 2 ? 0.1 * cell : 0.0, random)));
    const double height = size_m + random.unit() * std::max(0.3 * speed_m_s * dt_s, size_m);
    BodyState& s = world.add_body(world.add_shape(solid(kind, size_m)), Vec3(random.between(-1, 1) * cell, random.between(-1, 1) * cell, height));
    s.orientation = random.turn();
    s.linear_velocity_m_s = Vec3(0, 0, -speed_m_s);
    s.angular_velocity_rad_s = random.vector() * (trial % 4 == 3 ? speed_m_s / size_m : 0.0);
    world.run(12);
    const Vec3 end = world.states[0].position_m;
    const bool over = end.head<2>().cwiseAbs().maxCoeff() < 19.0 * cell;
    if (over && end.z() < -0.1 * cell) ++passed;
    if (!world.report.faults.empty()) ++passed;
  }
  return passed;
}

TEST(Meshes, NothingFallsThrough) {
  std::uint64_t seed = 1;
  for (const double dt : {1.0 / 20, 1.0 / 60, 1.0 / 240})
    for (const double speed : {0.1, 4.4, 30.0, 300.0})
      for (const double size : {0.005, 0.1, 1.0})
        for (int kind = 0; kind < 6; ++kind)
          EXPECT_EQ(passed_through(kind, size, speed, dt, ++seed), 0)
              << kNames[kind] << " of " << size << " m at " << speed << " m/s, dt " << dt;
}

}  // namespace
}  // namespace soda::physics
