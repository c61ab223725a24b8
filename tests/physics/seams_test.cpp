#include "physics/narrowphase/seams.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::World;

constexpr double kSide = 1.0, kTop = 0.0;
constexpr int kTiles = 14;

// Two triangles of a tile's size, seen from above.
TriangleMesh square_mesh() {
  const double h = 0.5 * kSide;
  TriangleMesh mesh;
  mesh.vertices_m = {Vec3(-h, -2, 0), Vec3(h, -2, 0), Vec3(h, 2, 0), Vec3(-h, 2, 0)};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

Shape block() { return Box{Vec3(0.5 * kSide, 2, 0.2)}; }

Shape hull_block() {
  std::vector<Vec3> corners;
  for (int i = 0; i < 8; ++i)
    corners.push_back(Vec3(i & 1 ? 0.5 : -0.5, i & 2 ? 2 : -2, i & 4 ? 0.2 : -0.2));
  return std::get<ConvexHull>(make_convex_hull(corners));
}

struct Floor {
  const char* name;
  double exact;  // share of the speed that may change
  std::function<void(World&, double x, int index)> add;
};

const Floor kFloors[] = {
    {"boxes", 1e-9,
     [](World& w, double x, int) { w.add_static(w.add_shape(block()), Vec3(x, 0, -0.2)); }},
    {"hulls", 1e-9,
     [](World& w, double x, int) { w.add_static(w.add_shape(hull_block()), Vec3(x, 0, -0.2)); }},
    {"meshes", 1e-9,
     [](World& w, double x, int) { w.add_static(w.add_shape(square_mesh()), Vec3(x, 0, 0)); }},
    {"a box, a mesh, and so on", 1e-9,
     [](World& w, double x, int i) {
       const bool mesh = i % 2 != 0;
       w.add_static(w.add_shape(mesh ? Shape(square_mesh()) : block()),
                    Vec3(x, 0, mesh ? 0 : -0.2));
     }},
    {"heavy boxes that are held by nothing", 1e-5,
     [](World& w, double x, int) { w.add_body(w.add_shape(block()), Vec3(x, 0, -0.2), 1e9); }}};

struct Slider {
  const char* name;
  Shape shape;
  double height_m;
  Quat orientation;
};

std::vector<Slider> sliders() {
  const Quat lies = test::about(Vec3::UnitY(), std::acos(-1.0) / 2);
  const Quat across = test::about(Vec3::UnitX(), std::acos(-1.0) / 2);
  return {{"box", Box{Vec3(0.2, 0.15, 0.1)}, 0.1, Quat::Identity()},
          {"askew box", Box{Vec3(0.2, 0.15, 0.1)}, 0.1, test::about(Vec3::UnitZ(), 0.3)},
          {"sphere", Sphere{0.2}, 0.2, Quat::Identity()},
          {"capsule along its motion", Capsule{0.1, 0.3}, 0.1, lies},
          {"cylinder on its side", Cylinder{0.2, 0.4}, 0.2, across},
          {"puck", Cylinder{0.2, 0.1}, 0.05, Quat::Identity()}};
}

// The slider on a row of tiles, at a speed along the row.
World row_of(const Floor& floor, const Slider& slider, double speed_m_s) {
  World world = test::under_gravity();
  const Material smooth{.friction = 0.0, .restitution = 0.0};
  BodyState& s = world.add_body(world.add_shape(slider.shape),
                                Vec3(0.13, 0, kTop + slider.height_m), 1000.0, smooth);
  s.orientation = slider.orientation;
  s.linear_velocity_m_s = Vec3(speed_m_s, 0, 0);
  for (int i = 0; i < kTiles; ++i) floor.add(world, i * kSide, i);
  for (BodyParams& body : world.scene.bodies) body.material = smooth;
  for (StaticBody& body : world.scene.statics) body.material = smooth;
  if (world.scene.bodies.size() > 1)
    world.add_static(world.add_shape(HalfSpace{}), Vec3(0, 0, -0.4));
  return world;
}

TEST(Seams, AreNoObstacleToWhatSlidesOverThem) {
  for (const Floor& floor : kFloors)
    for (const Slider& slider : sliders())
      for (const double speed : {0.3, 4.0, 11.0}) {
        World world = row_of(floor, slider, speed);
        const int steps = static_cast<int>(10.0 / speed / world.scene.dt_s);
        world.run(std::min(steps, 240));
        const std::string what = std::string(slider.name) + " over " + floor.name + ", " +
                                 std::to_string(speed) + " m/s";
        EXPECT_NEAR(world.states[0].linear_velocity_m_s.x(), speed, floor.exact * speed) << what;
        EXPECT_NEAR(world.states[0].position_m.z(), slider.height_m, 1e-6) << what;
      }
}

TEST(Seams, AnEdgeThatStandsOutStopsWhatSlides) {
  constexpr double kStep = 0.004;  // a fiftieth of its height
  World world = row_of(kFloors[0], sliders()[0], 4.0);
  for (std::size_t i = 5; i < world.scene.statics.size(); ++i)
    world.scene.statics[i].position_m.z() += kStep;
  world.run(120);
  EXPECT_LT(world.states[0].linear_velocity_m_s.x(), 3.0);
}

TEST(Seams, WhatLiesOverAFaceRestsOnIt) {
  World world = test::under_gravity();
  for (int i = 0; i < 2; ++i) kFloors[0].add(world, i * kSide, i);
  BodyState& s = world.add_body(world.add_shape(Box{Vec3(0.2, 0.2, 0.2)}), Vec3(0.5, 0, 0.2));
  s.linear_velocity_m_s = Vec3(1e-3, 0, 0);
  EXPECT_EQ(test::contacts_of(world, BodyId{0}, static_id(0)).size(), 1u);
  EXPECT_EQ(test::contacts_of(world, BodyId{0}, static_id(1)).size(), 1u);
}

}  // namespace
}  // namespace soda::physics
