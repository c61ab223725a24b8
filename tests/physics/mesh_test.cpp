#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "physics/narrowphase/near_triangles.hpp"
#include "physics/shapes/geometry_impl.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::World;

struct Random {
  std::mt19937_64 engine;
  double unit() { return static_cast<double>(engine() >> 11) * 0x1p-53; }
  double between(double low, double high) { return low + (high - low) * unit(); }
  Vec3 vector() { return {between(-1, 1), between(-1, 1), between(-1, 1)}; }
  Quat rotation() {
    return Quat(Eigen::Quaterniond(between(-1, 1), between(-1, 1), between(-1, 1), between(-1, 1))
                    .normalized());
  }
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
      const auto v = static_cast<std::uint32_t>(x * (cells + 1) + y),
                 row = static_cast<std::uint32_t>(cells + 1);
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

int passed_through(int kind, double size_m, double speed_m_s, double dt_s, std::uint64_t seed,
                   int trials) {
  Random random{std::mt19937_64(seed)};
  int passed = 0;
  for (int trial = 0; trial < trials; ++trial) {
    World world = test::under_gravity();
    world.scene.dt_s = dt_s;
    const double cell = size_m * random.between(0.3, 3.0);
    world.add_static(world.add_shape(grid(40, cell, trial % 2 ? 0.1 * cell : 0.0, random)));
    const double height = size_m + random.unit() * std::max(0.3 * speed_m_s * dt_s, size_m);
    BodyState& s =
        world.add_body(world.add_shape(solid(kind, size_m)),
                       Vec3(random.between(-1, 1) * cell, random.between(-1, 1) * cell, height));
    s.orientation = random.rotation();
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

// One of the kinds at each point of the family; over all seeds each with each.
TEST(Meshes, NothingFallsThrough) {
  std::uint64_t seed = 1;
  for (const double dt : {1.0 / 20, 1.0 / 60, 1.0 / 240})
    for (const double speed : {0.1, 4.4, 30.0, 300.0})
      for (const double size : {0.005, 0.1, 1.0}) {
        const int kind = static_cast<int>(++seed % 6);
        EXPECT_EQ(passed_through(kind, size, speed, dt, seed, 6), 0)
            << kNames[kind] << " of " << size << " m at " << speed << " m/s, dt " << dt;
      }
}

// The law of contacts near does not depend on how many triangles are elsewhere.
TEST(Meshes, TheWorkIsThatOfTheTrianglesNear) {
  std::size_t near = 0;
  for (const int cells : {10, 40, 160}) {
    Random random{std::mt19937_64(1)};
    World world = test::under_gravity();
    world.add_static(world.add_shape(grid(cells, 0.3, 0.0, random)));
    const Geometry geometry(world.scene);
    const CompiledShape& mesh = geometry.impl().shapes[0].shape;
    const CompiledShape ball = compile(Sphere{0.5});
    std::size_t boxes = 0;
    const Aabb box{Vec3(-0.5, -0.5, -0.1), Vec3(0.5, 0.5, 1.0)};
    mesh.tree.visit(
        [&](const Aabb& other) {
          ++boxes;
          return (other.min.array() <= box.max.array()).all() &&
                 (other.max.array() >= box.min.array()).all();
        },
        [](std::uint32_t) {});
    EXPECT_LT(boxes, 150u) << cells;
    const auto found = near_triangles({ball, {Mat3::Identity(), Vec3(0, 0, 0.5)}},
                                      {mesh, {Mat3::Identity(), Vec3::Zero()}}, 0.01);
    EXPECT_TRUE(std::is_sorted(found.begin(), found.end()));
    if (near > 0) {
      EXPECT_EQ(found.size(), near);
    }
    near = found.size();
  }
  EXPECT_GE(near, 8u);
  EXPECT_LE(near, 64u);
}

// Corners moved about in the plane, diagonals turned, and with a corner of its own for each
// triangle.
void spoil(double cell_m, bool apart, Random& random, TriangleMesh& mesh) {
  for (Vec3& v : mesh.vertices_m)
    v += Vec3(random.between(-0.3, 0.3) * cell_m, random.between(-0.3, 0.3) * cell_m, 0.0);
  for (std::size_t i = 0; i + 1 < mesh.triangles.size(); i += 2) {
    if (random.unit() < 0.5) continue;
    const auto a = mesh.triangles[i], b = mesh.triangles[i + 1];
    mesh.triangles[i] = {a[0], a[1], b[2]};
    mesh.triangles[i + 1] = {b[2], a[1], a[2]};
  }
  if (!apart) return;
  std::vector<Vec3> corners;
  for (auto& t : mesh.triangles)
    for (std::uint32_t& corner : t) {
      corners.push_back(mesh.vertices_m[corner]);
      corner = static_cast<std::uint32_t>(corners.size() - 1);
    }
  mesh.vertices_m = corners;
}

// How much the velocity changes in a second on ice (a sphere rolls, with friction).
double caught_m_s(int kind, double cell_m, double uneven_m, int spoiled) {
  Random random{std::mt19937_64(5)};
  World world = test::under_gravity();
  TriangleMesh mesh = grid(cell_m < 0.1 ? 60 : 30, cell_m, uneven_m, random);
  if (spoiled > 0) spoil(cell_m, spoiled > 1, random, mesh);
  Material material;
  material.friction = kind == 0 ? 0.5 : 0.0;
  world.add_static(world.add_shape(mesh), Vec3::Zero(), Quat::Identity(), material);
  const Shape shapes[] = {Sphere{0.5}, Box{Vec3(0.5, 0.4, 0.3)}, Cylinder{0.5, 0.6}};
  const double heights[] = {0.5, 0.3, 0.3};
  const Vec3 velocity(1.0, 0.3, 0.0);
  BodyState& s = world.add_body(world.add_shape(shapes[kind]),
                                Vec3(-0.7, 0.1, heights[kind] + uneven_m), 1000, material);
  s.linear_velocity_m_s = velocity;
  if (kind == 0) s.angular_velocity_rad_s = Vec3(-0.6, 2.0, 0.0);
  const Geometry geometry(world.scene);
  double most = 0.0;
  for (int i = 0; i < 60; ++i) {
    world.run(1, geometry);
    most = std::max(most, (world.states[0].linear_velocity_m_s - velocity).norm());
  }
  return most;
}

TEST(Meshes, EdgesWithinAFaceCatchNothing) {
  for (const double cell : {0.05, 0.3, 1.7})
    for (int kind = 0; kind < 3; ++kind)
      for (int spoiled = 0; spoiled < 3; ++spoiled)
        EXPECT_LT(caught_m_s(kind, cell, 0.0, spoiled), 1e-9)
            << kind << " cell " << cell << " spoiled " << spoiled;
}

// Slopes of 2 u / c pull by that share of g, and bumps are ridden over.
TEST(Meshes, UnevennessCatchesNothingMoreThanItsSlopes) {
  for (const double uneven : {1e-12, 1e-9, 1e-4})
    for (const double cell : {0.2, 0.3, 1.7})
      for (int kind = 0; kind < 3; ++kind)
        EXPECT_LT(caught_m_s(kind, cell, uneven, 0), 1e-6 + 60.0 * uneven / cell)
            << kind << " cell " << cell << " uneven " << uneven;
}

// A big box on a fine mesh has more points than a manifold has room for.
TEST(Meshes, ABoxStandsOnAsManyTrianglesAsThereAre) {
  for (const double cell : {0.2, 0.05, 0.02}) {
    Random random{std::mt19937_64(3)};
    World world = test::under_gravity();
    world.add_static(world.add_shape(grid(80, cell, 0.0, random)));
    world.add_body(world.add_shape(Box{}), Vec3(0.013, 0.007, 0.5));
    world.run(30);
    EXPECT_NEAR(world.states[0].position_m.z(), 0.5, 1e-3) << cell;
    EXPECT_LT(world.states[0].angular_velocity_rad_s.norm(), 1e-6) << cell;
  }
}

TriangleMesh stairs(int steps) {
  TriangleMesh mesh;
  const auto add = [&mesh](double x, double z) {
    mesh.vertices_m.push_back(Vec3(x, -2, z));
    mesh.vertices_m.push_back(Vec3(x, 2, z));
  };
  add(-3, 0);
  for (int i = 0; i < steps; ++i) {
    add(0.3 * i, -0.2 * i);
    add(0.3 * i, -0.2 * (i + 1));
  }
  for (std::uint32_t v = 0; v + 3 < mesh.vertices_m.size(); v += 2) {
    mesh.triangles.push_back({v, v + 2, v + 1});
    mesh.triangles.push_back({v + 1, v + 2, v + 3});
  }
  return mesh;
}

// What lies on a tread and reaches over the riser's upper edge is behind the riser, and not in it.
TEST(Meshes, WhatIsThrownDownStairsIsNoDeeperInThanItIs) {
  const Shape thrown[] = {Box{Vec3(0.15, 0.1, 0.125)}, Cylinder{0.12, 0.25}, Capsule{0.1, 0.2}};
  for (int trial = 0; trial < 30; ++trial) {
    Random random{std::mt19937_64(static_cast<std::uint64_t>(trial) + 1)};
    World world = test::under_gravity();
    world.add_static(world.add_shape(stairs(9)));
    BodyState& s = world.add_body(world.add_shape(thrown[trial % 3]),
                                  Vec3(-0.6, 0, random.between(0.25, 0.5)));
    s.orientation = random.rotation();
    s.linear_velocity_m_s = Vec3(random.between(1, 4), random.between(-0.5, 0.5), 0);
    double deepest = 0.0;
    for (int i = 0; i < 150; ++i) {
      world.run(1);
      for (const IslandReport& island : world.report.islands)
        deepest = std::max(deepest, island.max_penetration_m);
    }
    EXPECT_LT(deepest, 0.01) << trial;
  }
}

// Thin things at walls of 5 to 50 mm, spinning or not.
TEST(Walls, NoCentrePasses) {
  const Shape things[] = {Cylinder{0.004, 0.3}, Capsule{0.004, 0.3}, Box{Vec3::Constant(0.02)}};
  for (const double dt : {1.0 / 20, 1.0 / 60, 1.0 / 240})
    for (const double wall : {0.005, 0.01, 0.05})
      for (const double speed : {5.0, 30.0, 300.0})
        for (int trial = 0; trial < 15; ++trial) {
          Random random{std::mt19937_64(static_cast<std::uint64_t>(trial) + 1)};
          World world;
          world.scene.gravity_m_s2 = Vec3::Zero();
          world.scene.dt_s = dt;
          world.add_static(world.add_shape(Box{Vec3(0.5 * wall, 2, 2)}));
          BodyState& s =
              world.add_body(world.add_shape(things[trial % 3]),
                             Vec3(-random.between(0.3, 0.3 + std::min(2.0 * speed * dt, 2.0)),
                                  random.between(-0.3, 0.3), random.between(-0.3, 0.3)));
          s.orientation = random.rotation();
          s.linear_velocity_m_s = Vec3(speed, 0.3 * speed * random.between(-1, 1), 0);
          if (trial % 2 == 1)
            s.angular_velocity_rad_s = random.vector() * std::min(300.0, 10.0 * speed);
          const int steps = static_cast<int>(std::min(60.0, 4.0 + 1.0 / (speed * dt)));
          for (int i = 0; i < steps; ++i) {
            world.run(1);
            const Vec3& at = world.states[0].position_m;
            ASSERT_FALSE(at.x() > 0.0 && at.tail<2>().cwiseAbs().maxCoeff() < 1.8)
                << "wall " << wall << " speed " << speed << " dt " << dt << " trial " << trial;
          }
        }
}

}  // namespace
}  // namespace soda::physics
