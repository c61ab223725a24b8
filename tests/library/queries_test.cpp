// Contacts, rays and neighbours.
#include <gtest/gtest.h>

#include <cmath>

#include "library/arena.hpp"
#include "soda/simulation.hpp"

namespace soda {
namespace {

using namespace library_test;

// Nothing moves: solids in a row along x, 4 m apart, at z = 0.
Simulation row_of(const std::vector<Shape>& shapes) {
  SceneParts parts;
  parts.gravity_m_s2 = {};
  parts.materials = {{.name = "wood"}};
  for (std::uint32_t i = 0; i < shapes.size(); ++i)
    parts.bodies.push_back({.id = i,
                            .shape = shapes[i],
                            .material = "wood",
                            .mass_kg = 1.0,
                            .position_m = {4.0 * i, 0.0, 0.0}});
  return Simulation(Scene::build(parts));
}

const std::vector<Vec3> kOctahedron{{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                                    {0, -1, 0}, {0, 0, 1},  {0, 0, -1}};

TEST(LibraryContacts, BearTheWeightOfAPile) {
  Simulation simulation(arena());
  simulation.step(240);
  double weight = 0.0, borne = 0.0;
  for (std::uint32_t i = 0; i < 5; ++i) weight += 9.81 * simulation.scene().mass_kg(kFirstBox + i);
  for (const Contact& contact : simulation.contacts()) {
    if (!(contact.a == Solid{false, kFirstBox} && contact.b.is_static)) continue;
    EXPECT_TRUE(contact.touching);
    EXPECT_NEAR(contact.normal.z, -1.0, 1e-9);
    EXPECT_NEAR(contact.position_m.z, 0.0, 1e-3);
    EXPECT_NEAR(contact.normal_impulse_newton_s, contact.normal_newton / 120.0, 1e-12);
    borne += contact.normal_newton;
  }
  EXPECT_NEAR(borne, weight, 1e-3 * weight);
}

TEST(LibraryRays, EnterEveryShapeWhereItsSurfaceIs) {
  const Simulation simulation = row_of(
      {Sphere{0.5}, Box{{1.0, 1.0, 2.0}}, Capsule{0.5, 1.0}, Cylinder{0.5, 3.0}, Hull{kOctahedron},
       Compound{{{Box{{1, 1, 1}}, {0, 0, 1}, {}}, {Box{{1, 1, 1}}, {0, 0, -1}, {}}}}});
  const double tops[] = {0.5, 1.0, 1.0, 1.5, 1.0, 1.5};
  for (std::uint32_t i = 0; i < std::size(tops); ++i) {
    const auto hit = simulation.cast_ray({4.0 * i, 0.0, 10.0}, {0.0, 0.0, -2.0}, 20.0);
    ASSERT_TRUE(hit) << i;
    EXPECT_EQ(hit->solid, (Solid{false, i}));
    EXPECT_NEAR(hit->distance_m, 10.0 - tops[i], 1e-12) << i;
    EXPECT_NEAR(hit->point_m.z, tops[i], 1e-12);
    if (i != 4) {
      EXPECT_NEAR(hit->normal.z, 1.0, 1e-12) << i;
    }
    EXPECT_FALSE(simulation.cast_ray({4.0 * i, 0.0, 10.0}, {0.0, 0.0, -1.0}, 9.9 - tops[i]));
    EXPECT_FALSE(simulation.cast_ray({4.0 * i, 0.0, 10.0}, {0.0, 0.0, 1.0}, 20.0));
  }
  // From the side: the first of a row, and what is behind it from within.
  EXPECT_EQ(simulation.cast_ray({-5.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, 90.0)->solid.id, 0u);
  EXPECT_EQ(simulation.cast_ray({0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, 90.0)->solid.id, 1u);
  EXPECT_NEAR(simulation.cast_ray({8.0, -9.0, 0.7}, {0.0, 1.0, 0.0}, 90.0)->distance_m,
              9.0 - std::sqrt(0.25 - 0.04), 1e-12);  // the capsule's upper ball
}

TEST(LibraryRays, GrazeOrMissByWhatGeometrySays) {
  const Simulation simulation = row_of({Sphere{0.5}, Cylinder{0.5, 3.0}});
  EXPECT_TRUE(simulation.cast_ray({-5.0, 0.499, 0.0}, {1.0, 0.0, 0.0}, 8.0));
  EXPECT_FALSE(simulation.cast_ray({-5.0, 0.501, 0.0}, {1.0, 0.0, 0.0}, 8.0));
  EXPECT_TRUE(simulation.cast_ray({4.0, -3.0, 1.499}, {0.0, 1.0, 0.0}, 8.0));
  EXPECT_FALSE(simulation.cast_ray({4.0, -3.0, 1.501}, {0.0, 1.0, 0.0}, 8.0));
  EXPECT_THROW(simulation.cast_ray({}, {}, 1.0), UsageError);
  EXPECT_THROW(simulation.cast_ray({}, {1.0, 0.0, 0.0}, -1.0), UsageError);
}

TEST(LibraryRays, EnterMeshesFromTheFrontAndFloors) {
  SceneParts parts;
  parts.materials = {{.name = "wood"}};
  parts.statics = {
      {.name = "floor", .shape = HalfSpace{}, .material = "wood"},
      {.name = "roof",
       .shape = Mesh{{{-1, -1, 2}, {1, -1, 2}, {1, 1, 2}, {-1, 1, 2}}, {{0, 1, 2}, {0, 2, 3}}},
       .material = "wood"}};
  const Simulation simulation(Scene::build(parts));
  const auto roof = simulation.cast_ray({0.3, 0.2, 5.0}, {0.0, 0.0, -1.0}, 9.0);
  ASSERT_TRUE(roof);
  EXPECT_EQ(roof->solid, (Solid{true, 1}));
  EXPECT_NEAR(roof->distance_m, 3.0, 1e-12);
  const auto floor = simulation.cast_ray({0.3, 0.2, 1.0}, {0.0, 0.0, -1.0}, 9.0);
  ASSERT_TRUE(floor);
  EXPECT_EQ(floor->solid, (Solid{true, 0}));
  EXPECT_NEAR(floor->normal.z, 1.0, 1e-12);
  EXPECT_FALSE(simulation.cast_ray({0.3, 0.2, 1.0}, {0.0, 0.0, 1.0}, 9.0)) << "from behind";
}

TEST(LibraryNeighbours, AreFoundWithTheirDistance) {
  const Simulation simulation = row_of({Sphere{0.5}, Box{{1.0, 1.0, 1.0}}, Capsule{0.5, 1.0},
                                        Cylinder{0.5, 3.0}, Hull{kOctahedron}});
  const double sides[] = {0.5, 0.5, 0.5, 0.5, 1.0};  // along x, at z = 0
  for (std::uint32_t i = 0; i < std::size(sides); ++i) {
    const Vec3 place{4.0 * i - sides[i] - 0.5, 0.0, 0.0};
    const auto near = simulation.neighbours(Sphere{0.25}, place, {}, 0.5);
    ASSERT_EQ(near.size(), 1u) << i;
    EXPECT_EQ(near[0].solid, (Solid{false, i}));
    EXPECT_NEAR(near[0].distance_m, 0.25, 1e-9) << i;
    EXPECT_NEAR(near[0].normal.x, 1.0, 1e-6) << i;
    EXPECT_TRUE(simulation.neighbours(Sphere{0.25}, place, {}, 0.2).empty());
    const auto inside = simulation.neighbours(Box{{0.6, 0.6, 0.6}}, {place.x + 0.4, 0, 0}, {});
    ASSERT_EQ(inside.size(), 1u) << i;
    EXPECT_LT(inside[0].distance_m, -0.1) << i;
  }
}

TEST(LibraryNeighbours, AreStaticsToo) {
  Simulation simulation(arena());
  const auto near = simulation.neighbours(Hull{kOctahedron}, {20.0, 0.0, 1.25}, {}, 0.5);
  ASSERT_EQ(near.size(), 1u);
  EXPECT_EQ(near[0].solid, (Solid{true, 0}));
  EXPECT_NEAR(near[0].distance_m, 0.25, 1e-9);
  EXPECT_NEAR(near[0].normal.z, -1.0, 1e-9);
  EXPECT_THROW(simulation.neighbours(Sphere{0.0}, {}, {}), UsageError);
  EXPECT_THROW(simulation.neighbours(Hull{{{0, 0, 0}}}, {}, {}), UsageError);
}

}  // namespace
}  // namespace soda
