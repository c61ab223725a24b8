#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "physics/shapes/mass_properties.hpp"

namespace soda::physics {
namespace {

std::vector<Vec3> corners_of_box(const Vec3& half, const Vec3& center = Vec3::Zero()) {
  std::vector<Vec3> points;
  for (int i = 0; i < 8; ++i) {
    const Vec3 sign(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
    points.push_back(center + sign.cwiseProduct(half));
  }
  return points;
}

ConvexHull hull_of(std::vector<Vec3> points) {
  const auto result = make_convex_hull(points);
  EXPECT_TRUE(std::holds_alternative<ConvexHull>(result));
  return std::get<ConvexHull>(result);
}

TEST(ConvexHull, OfABoxHasSixQuadsSeenFromOutside) {
  const ConvexHull hull = hull_of(corners_of_box(Vec3(1, 2, 3)));
  EXPECT_EQ(hull.vertices_m.size(), 8u);
  ASSERT_EQ(hull.faces.size(), 6u);
  for (const auto& face : hull.faces) {
    ASSERT_EQ(face.size(), 4u);
    const Vec3& a = hull.vertices_m[face[0]];
    const Vec3 normal = (hull.vertices_m[face[1]] - a).cross(hull.vertices_m[face[2]] - a);
    EXPECT_GT(normal.dot(a), 0.0);
  }
}

TEST(ConvexHull, DoesNotDependOnTheOrderOfThePoints) {
  std::mt19937_64 random(1);
  std::vector<Vec3> points;
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53 - 0.5; };
  for (int i = 0; i < 60; ++i) {
    const double x = unit(), y = unit();
    points.push_back({x, y, unit()});
  }
  const ConvexHull first = hull_of(points);
  for (int trial = 0; trial < 20; ++trial) {
    std::shuffle(points.begin(), points.end(), random);
    const ConvexHull again = hull_of(points);
    EXPECT_EQ(again.vertices_m, first.vertices_m);
    EXPECT_EQ(again.faces, first.faces);
  }
}

TEST(ConvexHull, IsAClosedPolyhedronAroundAllPoints) {
  std::mt19937_64 random(2);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53 - 0.5; };
  for (int trial = 0; trial < 30; ++trial) {
    std::vector<Vec3> points;
    for (int i = 0; i < 40; ++i) {
      const double x = unit(), y = unit();
      points.push_back({x, y, unit()});
    }
    const ConvexHull hull = hull_of(points);
    std::size_t half_edges = 0;
    for (const auto& face : hull.faces) {
      half_edges += face.size();
      const Vec3& a = hull.vertices_m[face[0]];
      const Vec3 normal =
          (hull.vertices_m[face[1]] - a).cross(hull.vertices_m[face[2]] - a).normalized();
      for (const Vec3& p : points) EXPECT_LT(normal.dot(p - a), 1e-12);
    }
    EXPECT_EQ(hull.vertices_m.size() + hull.faces.size(), half_edges / 2 + 2) << "Euler";
  }
}

TEST(ConvexHull, PointsInsideOrOnFacesAreNoVertices) {
  std::vector<Vec3> points = corners_of_box(Vec3(1, 1, 1));
  points.push_back(Vec3::Zero());
  points.push_back(Vec3(1, 0, 0));
  points.push_back(Vec3(1, 1, 0));
  points.push_back(Vec3(1, 1, 1));
  const ConvexHull hull = hull_of(points);
  EXPECT_EQ(hull.faces.size(), 6u);
  const MassProperties p = mass_properties(Shape(hull));
  EXPECT_NEAR(p.volume_m3, 8.0, 1e-12);
}

TEST(ConvexHull, DegenerateInputSaysWhy) {
  const auto fault = [](std::vector<Vec3> points) {
    const auto result = make_convex_hull(points);
    const auto* text = std::get_if<std::string>(&result);
    return text ? *text : std::string("made a hull");
  };
  EXPECT_EQ(fault({}), "a hull needs at least four points");
  EXPECT_EQ(fault({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}), "a hull needs at least four points");
  EXPECT_EQ(fault({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}), "the points lie in one plane");
  EXPECT_EQ(fault({{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}}), "the points lie in one plane");
  EXPECT_EQ(fault(std::vector<Vec3>(9, Vec3(1, 2, 3))),
            "a hull needs at least four distinct points");
  EXPECT_EQ(fault({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, std::nan("")}}),
            "a point is not finite");
}

TEST(MassProperties, OfTheRoundSolidsMatchTheirClosedForms) {
  const MassProperties sphere = mass_properties(Sphere{2.0});
  EXPECT_DOUBLE_EQ(sphere.volume_m3, 4.0 / 3.0 * M_PI * 8.0);
  EXPECT_DOUBLE_EQ(sphere.inertia_per_density_m5(1, 1), 0.4 * sphere.volume_m3 * 4.0);
  const MassProperties cylinder = mass_properties(Cylinder{0.5, 3.0});
  EXPECT_DOUBLE_EQ(cylinder.volume_m3, M_PI * 0.25 * 3.0);
  EXPECT_DOUBLE_EQ(cylinder.inertia_per_density_m5(2, 2), 0.5 * cylinder.volume_m3 * 0.25);
  EXPECT_DOUBLE_EQ(cylinder.inertia_per_density_m5(0, 0),
                   cylinder.volume_m3 * (3.0 * 0.25 + 9.0) / 12.0);
}

// The capsule's moment across its axis by numerical integration of discs along the axis.
TEST(MassProperties, OfACapsuleMatchAnIntegralOverDiscs) {
  const double r = 0.4, length = 1.5, end = 0.5 * length + r;
  double volume = 0.0, across = 0.0, along = 0.0;
  constexpr int kDiscs = 200000;
  const double dz = 2.0 * end / kDiscs;
  for (int i = 0; i < kDiscs; ++i) {
    const double z = -end + (i + 0.5) * dz;
    const double beyond = std::max(0.0, std::abs(z) - 0.5 * length);
    const double disc = M_PI * (r * r - beyond * beyond);
    volume += disc * dz;
    across += disc * (disc / (4.0 * M_PI) + z * z) * dz;
    along += disc * disc / (2.0 * M_PI) * dz;
  }
  const MassProperties capsule = mass_properties(Capsule{r, length});
  EXPECT_NEAR(capsule.volume_m3, volume, 1e-9);
  EXPECT_NEAR(capsule.inertia_per_density_m5(0, 0), across, 1e-9);
  EXPECT_NEAR(capsule.inertia_per_density_m5(2, 2), along, 1e-9);
}

TEST(MassProperties, OfAHullMatchTheBoxItSpansAlsoFarFromTheOrigin) {
  const Vec3 half(0.5, 1.0, 1.5), center(10.0, -20.0, 30.0);
  const MassProperties hull = mass_properties(hull_of(corners_of_box(half, center)));
  const MassProperties box = mass_properties(Box{half});
  EXPECT_NEAR(hull.volume_m3, box.volume_m3, 1e-12);
  EXPECT_LT((hull.center_local_m - center).norm(), 1e-12);
  EXPECT_LT((hull.inertia_per_density_m5 - box.inertia_per_density_m5).norm(), 1e-11);
}

TEST(MassProperties, OfATetrahedronMatchTheClosedForm) {
  const MassProperties p = mass_properties(hull_of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}));
  EXPECT_NEAR(p.volume_m3, 1.0 / 6.0, 1e-15);
  EXPECT_LT((p.center_local_m - Vec3::Constant(0.25)).norm(), 1e-15);
  // About the centre: V * 3/40 on the diagonal, V/80 beside it.
  EXPECT_NEAR(p.inertia_per_density_m5(0, 0), 3.0 / 40.0 / 6.0, 1e-15);
  EXPECT_NEAR(p.inertia_per_density_m5(0, 1), 1.0 / 80.0 / 6.0, 1e-15);
}

TEST(MassProperties, OfStaticOnlyShapesAreZero) {
  EXPECT_EQ(mass_properties(HalfSpace{}).volume_m3, 0.0);
  EXPECT_EQ(mass_properties(TriangleMesh{}).volume_m3, 0.0);
}

}  // namespace
}  // namespace soda::physics
