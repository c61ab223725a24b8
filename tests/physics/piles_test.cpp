#include <gtest/gtest.h>

#include <cmath>

#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::World;

double deepest(const World& world) {
  double penetration = 0.0;
  for (const IslandReport& r : world.report.islands) {
    penetration = std::max(penetration, r.max_penetration_m);
  }
  return penetration;
}

TEST(Piles, StackOfTenBoxesStandsTenSeconds) {
  World world = test::under_gravity();
  world.add_floor();
  const std::uint32_t box = world.add_shape(Box{});
  for (int i = 0; i < 10; ++i) world.add_body(box, Vec3(0, 0, 0.5 + i));
  world.run(600);
  for (int i = 0; i < 10; ++i) {
    EXPECT_NEAR(world.states[i].position_m.z(), 0.5 + i, 6e-3) << "box " << i;
    EXPECT_LT(world.states[i].position_m.head<2>().norm(), 0.05) << "box " << i;
  }
}

TEST(Piles, PyramidOfTenRowsStandsFiveSeconds) {
  World world = test::under_gravity();
  world.add_floor();
  const std::uint32_t box = world.add_shape(Box{});
  std::vector<Vec3> start;
  for (int row = 0; row < 10; ++row) {
    for (int i = 0; i < 10 - row; ++i) {
      start.push_back(Vec3(i * 1.02 + row * 0.51, 0, 0.5 + row));
      world.add_body(box, start.back());
    }
  }
  world.run(300);
  for (std::size_t i = 0; i < start.size(); ++i) {
    EXPECT_LT((world.states[i].position_m - start[i]).norm(), 0.03) << "box " << i;
  }
  EXPECT_LT(deepest(world), 2e-3);
}

// `start` shifts boxes by millimetres.
World bin_of_boxes(int start) {
  World world = test::under_gravity();
  world.add_floor();
  const std::uint32_t wall_x = world.add_shape(Box{Vec3(0.5, 10, 20)});
  const std::uint32_t wall_y = world.add_shape(Box{Vec3(10, 0.5, 20)});
  world.add_static(wall_x, Vec3(-4, 0, 20));
  world.add_static(wall_x, Vec3(4, 0, 20));
  world.add_static(wall_y, Vec3(0, -4, 20));
  world.add_static(wall_y, Vec3(0, 4, 20));
  const std::uint32_t box = world.add_shape(Box{Vec3(0.4, 0.4, 0.4)});
  for (int i = 0; i < 300; ++i) {
    const int x = i % 6, y = i / 6 % 6, z = i / 36;
    world
        .add_body(box, Vec3(-2.6 + x + 0.03 * (z % 3) + 1e-3 * start * (7 * i % 5),
                            -2.6 + y + 0.05 * (z % 2), 0.6 + 1.1 * z))
        .orientation = test::about(Vec3(x + 1, y + 1, z + 1), 0.1 * (i % 5));
  }
  return world;
}

// The deepest overlap of such a fall is told apart by chance: the mean over several starts counts.
TEST(Piles, ThreeHundredBoxesFallingIntoABinGainNoEnergyAndStayApart) {
  constexpr int kStarts = 5;
  double sum_of_worst = 0.0;
  for (int of = 0; of < kStarts; ++of) {
    World world = bin_of_boxes(of);
    const Geometry geometry(world.scene);
    const auto energy = [&] {
      const Mechanics m = world.mechanics();
      return m.kinetic_energy_joule + m.potential_energy_joule;
    };
    const double start = energy();
    double last = start, largest_gain = 0.0, worst = 0.0;
    for (int i = 0; i < 300; ++i) {
      world.run(1, geometry);
      largest_gain = std::max(largest_gain, energy() - last);
      last = energy();
      worst = std::max(worst, deepest(world));
      ASSERT_TRUE(world.report.faults.empty());
    }
    EXPECT_LT(last, 0.8 * start);
    EXPECT_LT(largest_gain, 5e-4 * start) << "in one step, by push-out lifting bodies";
    EXPECT_LT(worst, 0.06) << "boxes are 0.8 m wide and fall at up to 11 m/s";
    sum_of_worst += worst;
    for (const BodyState& s : world.states) {
      EXPECT_GT(s.position_m.z(), 0.35);
      EXPECT_LT(s.position_m.head<2>().cwiseAbs().maxCoeff(), 3.5);
    }
  }
  EXPECT_LT(sum_of_worst / kStarts, 0.045);
}

TEST(Piles, AllSolidsSettleOnAMesh) {
  World world = test::under_gravity();
  TriangleMesh mesh;
  mesh.vertices_m = {{-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  world.add_static(world.add_shape(mesh));
  const auto tetrahedron = make_convex_hull(
      std::vector<Vec3>{{-0.5, -0.5, -0.5}, {0.5, 0.5, -0.5}, {0.5, -0.5, 0.5}, {-0.5, 0.5, 0.5}});
  const std::uint32_t shapes[] = {
      world.add_shape(Sphere{0.4}), world.add_shape(Box{Vec3(0.4, 0.3, 0.5)}),
      world.add_shape(Capsule{0.3, 0.6}), world.add_shape(Cylinder{0.4, 0.8}),
      world.add_shape(std::get<ConvexHull>(tetrahedron))};
  for (int i = 0; i < 25; ++i) {
    world.add_body(shapes[i % 5], Vec3(i % 5 * 1.2 - 2.4, i / 5 * 1.2 - 2.4, 1.0 + 0.2 * (i % 3)))
        .orientation = test::about(Vec3(1, i % 3, i % 4), 0.3 * i);
  }
  world.run(600);
  EXPECT_TRUE(world.report.faults.empty());
  EXPECT_LT(deepest(world), 0.01);
  for (std::size_t i = 0; i < world.states.size(); ++i) {
    EXPECT_GT(world.states[i].position_m.z(), 0.1) << "body " << i;
    EXPECT_LT(world.states[i].position_m.z(), 1.2) << "body " << i;
  }
}

}  // namespace
}  // namespace soda::physics
