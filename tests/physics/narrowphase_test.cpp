#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "physics/math/rigid_motion.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::World;

constexpr BodyId kA{0}, kB{1};

std::vector<Vec3> box_corners(const Vec3& half) {
  std::vector<Vec3> points;
  for (int i = 0; i < 8; ++i)
    points.push_back(half.cwiseProduct(Vec3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1)));
  return points;
}

Shape hull_box(const Vec3& half) {
  return std::get<ConvexHull>(make_convex_hull(box_corners(half)));
}

// All solids, of half height 0.5 along z when upright.
std::vector<Shape> solids() {
  return {Sphere{0.5}, Box{Vec3(0.5, 0.5, 0.5)}, Capsule{0.25, 0.5}, Cylinder{0.5, 1.0},
          hull_box(Vec3(0.5, 0.5, 0.5))};
}
const char* const kSolidNames[] = {"sphere", "box", "capsule", "cylinder", "hull"};

// Points each upright solid shows to a flat face below it.
constexpr std::uint32_t kPointsOnFlat[] = {1, 4, 1, 4, 4};

World on_support(const Shape& solid, const Shape& support, double gap, bool static_support) {
  World world;
  const std::uint32_t a = world.add_shape(solid);
  const std::uint32_t b = world.add_shape(support);
  world.add_body(a, Vec3(0.1, 0.05, 0.5 + gap));
  if (static_support) {
    world.add_static(b, Vec3(0, 0, -0.5));
  } else {
    world.add_body(b, Vec3(0, 0, -0.5));
  }
  return world;
}

void expect_flat_contact(const World& world, BodyId b, std::uint32_t points, double separation,
                         const std::string& what) {
  const std::vector<ContactManifold> manifolds = test::contacts_of(world, kA, b);
  ASSERT_EQ(manifolds.size(), 1u) << what;
  const ContactManifold& m = manifolds[0];
  EXPECT_EQ(m.count, points) << what;
  EXPECT_LT((m.normal - Vec3(0, 0, -1)).norm(), 1e-9) << what << ": from a to b";
  for (std::uint32_t i = 0; i < m.count; ++i) {
    EXPECT_NEAR(m.points[i].separation_m, separation, 1e-9) << what;
    EXPECT_NEAR(m.points[i].position_m.z(), 0.5 * separation, 1e-9) << what << ": midway";
    EXPECT_LT(m.points[i].position_m.norm(), 0.9) << what;
  }
}

TEST(Narrowphase, EverySolidOnAHalfspaceHasItsExactDepthAndPoints) {
  for (std::size_t s = 0; s < solids().size(); ++s) {
    for (const double gap : {-1e-2, -1e-4, 0.0, 1e-4}) {
      World world = on_support(solids()[s], HalfSpace{}, gap, true);
      world.scene.statics[0].position_m = Vec3::Zero();
      expect_flat_contact(world, static_id(0), kPointsOnFlat[s], gap, kSolidNames[s]);
    }
  }
}

TEST(Narrowphase, EverySolidOnABoxHasItsExactDepthAndPoints) {
  for (const bool static_support : {true, false}) {
    for (std::size_t s = 0; s < solids().size(); ++s) {
      for (const double gap : {-1e-2, -1e-4, 0.0, 1e-4}) {
        const World world = on_support(solids()[s], Box{Vec3(2, 2, 0.5)}, gap, static_support);
        expect_flat_contact(world, static_support ? static_id(0) : kB, kPointsOnFlat[s], gap,
                            std::string(kSolidNames[s]) + " gap " + std::to_string(gap));
      }
    }
  }
}

TEST(Narrowphase, EverySolidOnAHullHasItsExactDepthAndPoints) {
  for (std::size_t s = 0; s < solids().size(); ++s) {
    for (const double gap : {-1e-2, -1e-4, 0.0, 1e-4}) {
      const World world = on_support(solids()[s], hull_box(Vec3(2, 2, 0.5)), gap, false);
      expect_flat_contact(world, kB, kPointsOnFlat[s], gap,
                          std::string(kSolidNames[s]) + " gap " + std::to_string(gap));
    }
  }
}

TEST(Narrowphase, EverySolidOnACylindersCapHasItsExactDepth) {
  for (std::size_t s = 0; s < solids().size(); ++s) {
    for (const double gap : {-1e-2, -1e-4, 1e-4}) {
      const World world = on_support(solids()[s], Cylinder{2.0, 1.0}, gap, false);
      expect_flat_contact(world, kB, kPointsOnFlat[s], gap,
                          std::string(kSolidNames[s]) + " gap " + std::to_string(gap));
    }
  }
}

Shape mesh_floor() {
  TriangleMesh mesh;
  for (int x = -2; x <= 2; ++x) {
    for (int y = -2; y <= 2; ++y) mesh.vertices_m.push_back(Vec3(x, y, 0.5));
  }
  for (std::uint32_t x = 0; x < 4; ++x) {
    for (std::uint32_t y = 0; y < 4; ++y) {
      const std::uint32_t v = 5 * x + y;
      mesh.triangles.push_back({v, v + 5, v + 6});
      mesh.triangles.push_back({v, v + 6, v + 1});
    }
  }
  return mesh;
}

TEST(Narrowphase, EverySolidOnAFlatMeshHasOneManifoldForAllItsTriangles) {
  for (std::size_t s = 0; s < solids().size(); ++s) {
    for (const double gap : {-1e-2, -1e-4, 1e-4}) {
      const World world = on_support(solids()[s], mesh_floor(), gap, true);
      expect_flat_contact(world, static_id(0), kPointsOnFlat[s], gap,
                          std::string(kSolidNames[s]) + " gap " + std::to_string(gap));
    }
  }
}

TEST(Narrowphase, MeshFacesTurnedAwayDoNotTouch) {
  World world = on_support(Box{}, mesh_floor(), 0.0, true);
  world.states[0].position_m.z() = -0.5 + 0.01;  // from below
  EXPECT_TRUE(test::contacts_of(world, kA, static_id(0)).empty());
}

TEST(Narrowphase, CapsuleLyingOnABoxTouchesInTwoPoints) {
  World world;
  const std::uint32_t capsule = world.add_shape(Capsule{0.25, 1.0});
  const std::uint32_t box = world.add_shape(Box{Vec3(2, 2, 0.5)});
  world.add_body(capsule, Vec3(0.3, 0, 0.249)).orientation = test::about(Vec3::UnitY(), M_PI / 2);
  world.add_body(box, Vec3(0, 0, -0.5));
  const auto manifolds = test::contacts_of(world, kA, kB);
  ASSERT_EQ(manifolds.size(), 1u);
  ASSERT_EQ(manifolds[0].count, 2u);
  EXPECT_NEAR(manifolds[0].points[0].separation_m, -1e-3, 1e-9);
  EXPECT_NEAR(manifolds[0].points[1].separation_m, -1e-3, 1e-9);
  const Vec3 apart = manifolds[0].points[0].position_m - manifolds[0].points[1].position_m;
  EXPECT_NEAR(apart.norm(), 1.0, 1e-9);
}

TEST(Narrowphase, CylinderLyingTouchesInTwoPoints) {
  for (const bool on_box : {true, false}) {
    World world;
    const std::uint32_t cylinder = world.add_shape(Cylinder{0.25, 1.0});
    world.add_body(cylinder, Vec3(0.3, 0, 0.249)).orientation =
        test::about(Vec3::UnitX(), M_PI / 2);
    const std::uint32_t support =
        world.add_shape(on_box ? Shape(Box{Vec3(2, 2, 0.5)}) : Shape(HalfSpace{}));
    world.add_static(support, Vec3(0, 0, on_box ? -0.5 : 0.0));
    const auto manifolds = test::contacts_of(world, kA, static_id(0));
    ASSERT_EQ(manifolds.size(), 1u);
    ASSERT_EQ(manifolds[0].count, 2u);
    EXPECT_NEAR(manifolds[0].points[0].separation_m, -1e-3, 1e-9);
    EXPECT_NEAR(manifolds[0].points[1].separation_m, -1e-3, 1e-9);
  }
}

TEST(Narrowphase, ParallelCapsulesTouchInTwoPointsCrossedOnesInOne) {
  World world;
  const std::uint32_t capsule = world.add_shape(Capsule{0.25, 1.0});
  world.add_body(capsule, Vec3::Zero());
  world.add_body(capsule, Vec3(0.49, 0, 0.2));
  auto manifolds = test::contacts_of(world, kA, kB);
  ASSERT_EQ(manifolds.size(), 1u);
  EXPECT_EQ(manifolds[0].count, 2u);
  EXPECT_LT((manifolds[0].normal - Vec3::UnitX()).norm(), 1e-12);
  EXPECT_NEAR(manifolds[0].points[0].separation_m, -0.01, 1e-12);

  world.states[1].orientation = test::about(Vec3::UnitX(), M_PI / 2);
  manifolds = test::contacts_of(world, kA, kB);
  ASSERT_EQ(manifolds.size(), 1u);
  EXPECT_EQ(manifolds[0].count, 1u);
  EXPECT_NEAR(manifolds[0].points[0].separation_m, -0.01, 1e-12);
}

TEST(Narrowphase, CapsulesEndToEndTouchInOnePoint) {
  World world;
  const std::uint32_t capsule = world.add_shape(Capsule{0.25, 1.0});
  world.add_body(capsule, Vec3::Zero());
  world.add_body(capsule, Vec3(0, 0, 1.49));
  const auto manifolds = test::contacts_of(world, kA, kB);
  ASSERT_EQ(manifolds.size(), 1u);
  ASSERT_EQ(manifolds[0].count, 1u);
  EXPECT_LT((manifolds[0].normal - Vec3::UnitZ()).norm(), 1e-12);
  EXPECT_NEAR(manifolds[0].points[0].separation_m, -0.01, 1e-12);
  EXPECT_LT((manifolds[0].points[0].position_m - Vec3(0, 0, 0.745)).norm(), 1e-12);
}

TEST(Narrowphase, CrossedBoxEdgesTouchInOnePointBetweenThem) {
  World world;
  const std::uint32_t box = world.add_shape(Box{Vec3(0.5, 0.5, 0.5)});
  world.add_body(box, Vec3(0, 0, 0)).orientation = test::about(Vec3::UnitX(), M_PI / 4);
  world.add_body(box, Vec3(0, 0, std::sqrt(2.0) - 1e-3)).orientation =
      test::about(Vec3::UnitY(), M_PI / 4);
  const auto manifolds = test::contacts_of(world, kA, kB);
  ASSERT_EQ(manifolds.size(), 1u);
  ASSERT_EQ(manifolds[0].count, 1u);
  EXPECT_LT((manifolds[0].normal - Vec3::UnitZ()).norm(), 1e-9);
  EXPECT_NEAR(manifolds[0].points[0].separation_m, -1e-3, 1e-9);
  EXPECT_LT((manifolds[0].points[0].position_m - Vec3(0, 0, std::sqrt(0.5) - 5e-4)).norm(), 1e-9);
}

TEST(Narrowphase, SphereAgainstBoxCornerEdgeAndInsideMatchesTheClosedForm) {
  World world;
  const std::uint32_t sphere = world.add_shape(Sphere{0.5});
  const std::uint32_t box = world.add_shape(Box{Vec3(1, 1, 1)});
  world.add_body(sphere, Vec3(1.28, 1.28, 1.28));
  world.add_body(box, Vec3::Zero());
  auto contact = test::contacts_of(world, kA, kB);
  ASSERT_EQ(contact.size(), 1u);
  EXPECT_NEAR(contact[0].points[0].separation_m, 0.28 * std::sqrt(3.0) - 0.5, 1e-12);
  EXPECT_LT((contact[0].normal + Vec3::Constant(1.0 / std::sqrt(3.0))).norm(), 1e-12);
  world.states[0].position_m = Vec3(0.9, 0, 0);
  contact = test::contacts_of(world, kA, kB);
  ASSERT_EQ(contact.size(), 1u);
  EXPECT_NEAR(contact[0].points[0].separation_m, -0.6, 1e-12);
  EXPECT_LT((contact[0].normal + Vec3::UnitX()).norm(), 1e-12);
}

// The lower end of a leaning capsule passes an edge of a box, and the nearest point with it.
TEST(Narrowphase, ACapsulesEndThatPassesAnEdgeIsAsFarAsItIs) {
  const Vec3 half(0.5, 3.0, 0.5);
  constexpr double kRadius = 0.15, kLength = 0.35, kGap = -0.01;
  constexpr double kFacePreference = 0.05;  // of the depth: a face's normal is taken all the same
  for (const double lean_degrees : {5.0, 20.0, 45.0, 70.0, 85.0})
    for (int beyond_mm = -20; beyond_mm <= 60; ++beyond_mm) {
      const double lean = lean_degrees * M_PI / 180.0;
      const Vec3 along(-std::sin(lean), 0, std::cos(lean));
      const Vec3 end(0.5 + 1e-3 * beyond_mm, 0.1, 0.5 + kRadius + kGap);
      World world;
      world.add_body(world.add_shape(Capsule{kRadius, kLength}), end + along * (0.5 * kLength))
          .orientation = turn_between(Vec3::UnitZ(), along);
      world.add_static(world.add_shape(Box{half}));
      double nearest = 1e300;
      for (int i = 0; i <= 100000; ++i) {
        const Vec3 point = end + along * (kLength * 1e-5 * i);
        nearest = std::min(nearest, (point - point.cwiseMax(-half).cwiseMin(half)).norm());
      }
      if (nearest - kRadius > 0.002) continue;
      double least = 1e300;
      for (const ContactManifold& m : test::contacts_of(world, kA, static_id(0)))
        for (std::uint32_t i = 0; i < m.count; ++i)
          least = std::min(least, m.points[i].separation_m);
      EXPECT_NEAR(least, nearest - kRadius,
                  1e-3 * 2.0 * kRadius + kFacePreference * std::max(0.0, kRadius - nearest))
          << lean_degrees << " degrees, " << beyond_mm << " mm beyond";
    }
}

TEST(Narrowphase, SphereAgainstCylinderRimSideAndCapMatchesTheClosedForm) {
  World world;
  const std::uint32_t sphere = world.add_shape(Sphere{0.5});
  const std::uint32_t cylinder = world.add_shape(Cylinder{1.0, 2.0});
  world.add_body(sphere, Vec3::Zero());
  world.add_body(cylinder, Vec3::Zero());
  const auto separation_at = [&](const Vec3& p) {
    world.states[0].position_m = p;
    const auto contact = test::contacts_of(world, kA, kB);
    return contact.size() == 1 ? contact[0].points[0].separation_m : 1.0;
  };
  EXPECT_NEAR(separation_at(Vec3(0, 1.49, 0.3)), -0.01, 1e-12);
  EXPECT_NEAR(separation_at(Vec3(0.2, 0.3, 1.49)), -0.01, 1e-12);
  EXPECT_NEAR(separation_at(Vec3(1.3, 0, 1.3)), 0.3 * std::sqrt(2.0) - 0.5, 1e-12);
  EXPECT_NEAR(separation_at(Vec3(0.9, 0, 0.2)), -0.6, 1e-12);
  EXPECT_EQ(separation_at(Vec3(1.4, 0, 1.4)), 1.0);  // 0.566 away: apart
}

TEST(Narrowphase, SphereOnMeshEdgesTouchesConvexOnesOnly) {
  TriangleMesh roof;  // a ridge along y at z = 0, falling to both sides
  roof.vertices_m = {{-1, -1, -1}, {-1, 1, -1}, {0, -1, 0}, {0, 1, 0}, {1, -1, -1}, {1, 1, -1}};
  roof.triangles = {{0, 2, 3}, {0, 3, 1}, {2, 4, 5}, {2, 5, 3}};
  World world;
  const std::uint32_t sphere = world.add_shape(Sphere{0.5});
  world.add_body(sphere, Vec3(0, 0, 0.499));
  world.add_static(world.add_shape(roof));
  const auto on_ridge = test::contacts_of(world, kA, static_id(0));
  ASSERT_FALSE(on_ridge.empty());
  for (const ContactManifold& m : on_ridge) {
    EXPECT_LT((m.normal + Vec3::UnitZ()).norm(), 1e-12);
    EXPECT_NEAR(m.points[0].separation_m, -1e-3, 1e-12);
  }

  World valley;
  for (Vec3& v : roof.vertices_m) v.z() = -v.z();
  valley.add_body(valley.add_shape(Sphere{0.5}), Vec3(0, 0, 0.5 * std::sqrt(2.0) - 1e-3));
  valley.add_static(valley.add_shape(roof));
  const auto in_valley = test::contacts_of(valley, kA, static_id(0));
  ASSERT_EQ(in_valley.size(), 2u) << "one contact a side, none with the bottom edge";
  for (const ContactManifold& m : in_valley) {
    EXPECT_NEAR(std::abs(m.normal.x()), std::sqrt(0.5), 1e-12);
  }
}

// Both bodies of a pair may be the lower one: the contact is the same, seen from the other side.
TEST(Narrowphase, SwappingTheBodiesTurnsTheNormalAround) {
  std::mt19937_64 random(4);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53 - 0.5; };
  const auto vector = [&] {
    const double x = unit(), y = unit();
    return Vec3(x, y, unit());
  };
  // Pairs whose normal has one exact answer.
  const std::vector<std::pair<std::size_t, std::size_t>> kinds = {{0, 0}, {0, 1}, {0, 2}, {0, 3},
                                                                  {0, 4}, {2, 2}, {2, 1}, {2, 4}};
  int tested = 0;
  for (const auto& [ka, kb] : kinds) {
    for (int trial = 0; trial < 100; ++trial) {
      World world, swapped;
      world.scene.shapes = swapped.scene.shapes = solids();
      const Vec3 pa = vector(), pb = vector() * 2.0;
      const Quat qa = test::about(vector(), 6 * unit()), qb = test::about(vector(), 6 * unit());
      world.add_body(ka, pa).orientation = qa;
      world.add_body(kb, pb).orientation = qb;
      swapped.add_body(kb, pb).orientation = qb;
      swapped.add_body(ka, pa).orientation = qa;
      const auto one = test::contacts_of(world, kA, kB), two = test::contacts_of(swapped, kA, kB);
      // Deep overlap beyond the cores has no unique normal.
      if (one.empty() || one[0].points[0].separation_m < -0.2) continue;
      ASSERT_EQ(two.size(), 1u) << kSolidNames[ka] << "-" << kSolidNames[kb];
      EXPECT_LT((one[0].normal + two[0].normal).norm(), 1e-5)
          << kSolidNames[ka] << "-" << kSolidNames[kb];
      EXPECT_GT(one[0].normal.dot(pb - pa), -0.2);
      ++tested;
    }
  }
  EXPECT_GT(tested, 100);
}

TEST(Narrowphase, FarFromTheOriginTheContactIsTheSame) {
  for (std::size_t s = 0; s < solids().size(); ++s) {
    World near = on_support(solids()[s], Box{Vec3(2, 2, 0.5)}, -0x1p-7, false);
    World far = near;
    const Vec3 offset(0x1p23, -0x1p22, 0x1p23);  // keeps 2^-29 m
    for (World* world : {&near, &far}) {
      world->states[0].position_m = Vec3(0.125, 0.0625, 0.5 - 0x1p-7);
    }
    for (BodyState& state : far.states) state.position_m += offset;
    const auto a = test::contacts_of(near, kA, kB), b = test::contacts_of(far, kA, kB);
    ASSERT_EQ(a.size(), 1u);
    ASSERT_EQ(b.size(), 1u);
    ASSERT_EQ(a[0].count, b[0].count) << kSolidNames[s];
    EXPECT_EQ(a[0].normal, b[0].normal) << kSolidNames[s];
    for (std::uint32_t i = 0; i < a[0].count; ++i) {
      EXPECT_EQ(a[0].points[i].separation_m, b[0].points[i].separation_m) << kSolidNames[s];
      EXPECT_EQ(a[0].points[i].feature, b[0].points[i].feature) << kSolidNames[s];
    }
  }
}

TEST(Narrowphase, PointsAreInCanonicalOrder) {
  std::mt19937_64 random(9);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53 - 0.5; };
  for (int trial = 0; trial < 300; ++trial) {
    World world;
    world.scene.shapes = solids();
    const std::size_t kinds = solids().size();
    world.add_body(random() % kinds, Vec3(unit(), unit(), 0.0));
    world.add_body(random() % kinds, Vec3(0, 0, 0.95)).orientation =
        test::about(Vec3(0.01 * unit(), 0, 1), 6 * unit());
    for (const ContactManifold& m : test::contacts_of(world, kA, kB)) {
      EXPECT_GE(m.count, 1u);
      EXPECT_LE(m.count, 4u);
      EXPECT_NEAR(m.normal.norm(), 1.0, 1e-12);
      for (std::uint32_t i = 1; i < m.count; ++i) {
        EXPECT_LE(m.points[i - 1].feature, m.points[i].feature);
      }
    }
  }
}

TEST(Narrowphase, CountersNameTheKernelUsed) {
  World world = on_support(Box{}, Box{Vec3(2, 2, 0.5)}, 0.0, false);
  const Geometry geometry(world.scene);
  StageCounters counters;
  std::vector<ContactManifold> out;
  collide({world.scene, geometry, world.scene.dt_s, kA, world.states[0], kB, &world.states[1]}, out,
          counters);
  for (std::size_t k = 0; k < counters.narrowphase_tests.size(); ++k) {
    const bool box_box = static_cast<ShapeKernel>(k) == ShapeKernel::kBoxBox;
    EXPECT_EQ(counters.narrowphase_tests[k], box_box ? 1u : 0u);
  }
  EXPECT_EQ(kernel_for(world.scene.shapes[0], world.scene.shapes[1]), ShapeKernel::kBoxBox);
  EXPECT_EQ(counters.manifolds, 1u);
  EXPECT_EQ(counters.contact_points, 4u);
}

}  // namespace
}  // namespace soda::physics
