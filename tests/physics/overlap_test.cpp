// Solids that overlap: along which direction, and how deep contacts say that it is.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "physics/narrowphase/contact_features.hpp"
#include "physics/narrowphase/core_distance.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::World;

constexpr BodyId kA{0}, kB{1};

Vec3 random_direction(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  return Vec3(normal(random), normal(random), normal(random)).normalized();
}

Quat random_rotation(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  return Quat(normal(random), normal(random), normal(random), normal(random)).normalized();
}

std::vector<Shape> solids() {
  const std::vector<Vec3> spikes = {{0.5, 0, 0},  {-0.5, 0, 0}, {0, 0.5, 0},
                                    {0, -0.5, 0}, {0, 0, 0.6},  {0, 0, -0.4}};
  return {Box{Vec3(0.4, 0.3, 0.25)}, Capsule{0.25, 0.6}, Cylinder{0.35, 0.7},
          std::get<ConvexHull>(make_convex_hull(spikes))};
}

// The largest separation that some direction shows: a search, by many directions and then near the
// best of them.
double largest_separation(const PlacedShape& a, const PlacedShape& b, std::mt19937_64& random) {
  Vec3 best = Vec3::UnitZ();
  double most = -1e300;
  const auto look = [&](const Vec3& direction) {
    const double separation = separation_along(a, b, direction);
    if (separation > most) most = separation, best = direction;
  };
  for (int i = 0; i < 2000; ++i) look(random_direction(random));
  for (double wide = 0.3; wide > 1e-5; wide *= 0.97)
    look((best + wide * random_direction(random)).normalized());
  return most;
}

// By how much solids overlap along the contact's normal, over the least overlap that there is;
// ascending.
std::vector<double> overlaps(Narrowphase narrowphase) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> near(0.3, 1.0);
  std::vector<double> ratios;
  const std::vector<Shape> shapes = solids();
  for (std::size_t i = 0; i < 4000; ++i) {
    World world;
    world.scene.narrowphase = narrowphase;
    for (const std::size_t which : {i % shapes.size(), i / shapes.size() % shapes.size()}) {
      const Vec3 at =
          world.ids.empty() ? Vec3(Vec3::Zero()) : Vec3(near(random) * random_direction(random));
      world.add_body(world.add_shape(shapes[which]), at).orientation = random_rotation(random);
    }
    const CompiledShape a = compile(world.scene.shapes[0]), b = compile(world.scene.shapes[1]);
    const auto placed = [&](const CompiledShape& shape, const BodyState& state) {
      return PlacedShape{shape, {state.orientation.toRotationMatrix(), state.position_m}};
    };
    const PlacedShape pa = placed(a, world.states[0]), pb = placed(b, world.states[1]);
    const double most = largest_separation(pa, pb, random);
    const double width = std::min(a.min_extent_m, b.min_extent_m);
    if (most > -0.02 * width || most < -0.2 * width) continue;
    const std::vector<ContactManifold> found = test::contacts_of(world, kA, kB);
    EXPECT_EQ(found.size(), 1u) << "pair " << i;
    if (!found.empty()) ratios.push_back(separation_along(pa, pb, found[0].normal) / most);
  }
  std::ranges::sort(ratios);
  return ratios;
}

TEST(Overlap, IsAlongADirectionInWhichItIsAboutLeast) {
  for (const Narrowphase own : {Narrowphase::kOwn, Narrowphase::kAuto}) {
    const std::vector<double> ratios = overlaps(own);
    ASSERT_GT(ratios.size(), 500u);
    EXPECT_GT(ratios.front(), 0.9) << "the search is no reference";
    EXPECT_LT(ratios[ratios.size() / 2], 1.001);
    EXPECT_LT(ratios[ratios.size() * 99 / 100], 1.1);
    EXPECT_LT(ratios.back(), 1.2);
  }
}

// MPR's directions are no better than that, though faces that separate more replace them.
TEST(Overlap, IsAlongAWorseDirectionByFcl) {
  const std::vector<double> ratios = overlaps(Narrowphase::kFcl);
  ASSERT_GT(ratios.size(), 500u);
  EXPECT_LT(ratios[ratios.size() / 2], 1.001);
  EXPECT_LT(ratios.back(), 10.0);
  EXPECT_GT(ratios.back(), overlaps(Narrowphase::kOwn).back());
}

// Rims of cylinders, and what they are pressed into.
constexpr std::size_t kOthers = 5;
constexpr std::size_t kHull = 4;

Shape drawn_solid(std::size_t which, std::mt19937_64& random, double size_m) {
  std::uniform_real_distribution<double> share(-2.0, 2.0);
  const double half = size_m * std::pow(10.0, share(random));  // 1:100 to 100:1
  const double x = 0.9 * size_m, y = size_m;
  const std::vector<Vec3> spikes = {{x, 0, 0},  {-x, 0, 0},         {0, y, 0},
                                    {0, -y, 0}, {0, 0, 1.2 * half}, {0, 0, -0.8 * half}};
  switch (which) {
    case 0:
      return Sphere{size_m};
    case 1:
      return Box{Vec3(x, y, half)};
    case 2:
      return Capsule{size_m, 2.0 * half};
    case 3:
      return Cylinder{size_m, 2.0 * half};
    default:
      return std::get<ConvexHull>(make_convex_hull(spikes));
  }
}

struct Pressed {
  World world;
  std::vector<CompiledShape> shapes;
  double width_m = 0.0;
  bool met = false;
  Vec3 normal = Vec3::UnitZ();

  PlacedShape placed(std::size_t i) const {
    const BodyState& state = world.states[i];
    return {shapes[i], {state.orientation.toRotationMatrix(), state.position_m}};
  }
  Vec3 inner_point(std::size_t i, std::mt19937_64& random) const {
    std::uniform_real_distribution<double> share(0.0, 1.0);
    return world.states[i].orientation *
           (share(random) * support(shapes[i], random_direction(random)));
  }
};

// A cylinder and another, turned anyhow, of 1e-4 to 1 m, up to a ratio of ten: some point in one is
// moved towards some point in the other until they are this far apart, along the normal of what is
// nearest then. Negative: they overlap by that along it.
Pressed pressed(std::size_t other, double widths_apart, std::mt19937_64& random) {
  std::uniform_real_distribution<double> size(-4.0, 0.0), ratio(-1.0, 1.0);
  Pressed out;
  const double size_m = std::pow(10.0, size(random));
  const double sizes_m[2] = {size_m, std::min(1.0, size_m * std::pow(10.0, ratio(random)))};
  for (std::size_t i = 0; i < 2; ++i) {
    const Shape shape = drawn_solid(i == 0 ? 3 : other, random, sizes_m[i]);
    out.world.add_body(out.world.add_shape(shape), Vec3::Zero()).orientation =
        random_rotation(random);
    out.shapes.push_back(compile(shape));
  }
  out.width_m = std::min(out.shapes[0].min_extent_m, out.shapes[1].min_extent_m);
  const double skin = skin_of(out.shapes[0]) + skin_of(out.shapes[1]);
  const Vec3 direction = random_direction(random);
  Vec3& at = out.world.states[1].position_m;
  at = out.inner_point(0, random) - out.inner_point(1, random) +
       2.1 * (out.shapes[0].bounding_radius_m + out.shapes[1].bounding_radius_m) * direction;
  for (int trial = 0; trial < 200 && !out.met; ++trial) {
    const CoreGap gap =
        core_gap({out.placed(0), skin_of(out.shapes[0])}, {out.placed(1), skin_of(out.shapes[1])},
                 direction, 1e-12 * out.width_m);
    if (gap.overlap) return out;
    const double gap_m = gap.distance_m - skin;
    out.met = gap_m < 1e-3 * out.width_m;
    out.normal = gap.normal;
    at -=
        out.met ? Vec3(gap.normal * (gap_m - widths_apart * out.width_m)) : Vec3(direction * gap_m);
  }
  return out;
}

struct RimDepths {
  int pairs = 0, unseen = 0;
  std::vector<double>
      ratios;  // along the contact's normal, over the least that is known; ascending
};

RimDepths rim_depths(std::size_t other) {
  std::mt19937_64 random(17 + other);
  std::uniform_real_distribution<double> log_depth(-4.0, std::log10(0.2));
  RimDepths out;
  for (int i = 0; i < 800; ++i) {
    const Pressed pair = pressed(other, -std::pow(10.0, log_depth(random)), random);
    if (!pair.met) continue;
    ++out.pairs;
    const std::vector<ContactManifold> found = test::contacts_of(pair.world, kA, kB);
    if (found.empty()) {
      ++out.unseen;
      continue;
    }
    const PlacedShape a = pair.placed(0), b = pair.placed(1);
    const double said = separation_along(a, b, found[0].normal);
    const double known =
        std::max(separation_along(a, b, pair.normal), largest_separation(a, b, random));
    out.ratios.push_back(said / known);
    double deepest = 1e300;
    for (std::uint32_t p = 0; p < found[0].count; ++p)
      deepest = std::min(deepest, found[0].points[p].separation_m);
    EXPECT_NEAR(deepest, said, 1.1e-3 * pair.width_m) << "shape " << other << ", pair " << i;
  }
  std::ranges::sort(out.ratios);
  return out;
}

// Rims are edges: with the skin of a rounded cylinder, an overlap of less than a twentieth of the
// radius had no contact.
TEST(Overlap, OfRimsIsSeenAndAsDeepAsItIsHoweverThinOrSmall) {
  for (std::size_t other = 0; other < kOthers; ++other) {
    const RimDepths depths = rim_depths(other);
    ASSERT_GT(depths.pairs, 700) << "shape " << other;
    EXPECT_EQ(depths.unseen, 0) << "shape " << other;
    EXPECT_LT(depths.ratios[depths.ratios.size() * 98 / 100], 1.1) << "shape " << other;
    EXPECT_LT(depths.ratios.back(), other == kHull ? 10.0 : 1.2) << "shape " << other;
  }
}

TEST(Overlap, OfRimsIsNoneBeyondTheMargin) {
  std::mt19937_64 random(23);
  std::uniform_real_distribution<double> gap(0.0101, 0.5);
  for (std::size_t other = 0; other < kOthers; ++other)
    for (int i = 0; i < 400; ++i) {
      const Pressed pair = pressed(other, gap(random), random);
      if (!pair.met) continue;
      EXPECT_TRUE(test::contacts_of(pair.world, kA, kB).empty()) << "shape " << other;
    }
}

// Hills of random heights on a grid of unit cells, two triangles each.
TriangleMesh hills(double rise_m, std::mt19937_64& random) {
  constexpr std::uint32_t kSide = 7;
  std::uniform_real_distribution<double> height(-rise_m, rise_m);
  TriangleMesh mesh;
  for (std::uint32_t y = 0; y < kSide; ++y)
    for (std::uint32_t x = 0; x < kSide; ++x)
      mesh.vertices_m.push_back(Vec3(x - 3.0, y - 3.0, height(random)));
  for (std::uint32_t y = 0; y + 1 < kSide; ++y)
    for (std::uint32_t x = 0; x + 1 < kSide; ++x) {
      const std::uint32_t v = y * kSide + x;
      mesh.triangles.push_back({v, v + 1, v + kSide + 1});
      mesh.triangles.push_back({v, v + kSide + 1, v + kSide});
    }
  return mesh;
}

double distance_to(const std::array<Vec3, 3>& t, const Vec3& p) {
  const Vec3 normal = (t[1] - t[0]).cross(t[2] - t[0]).normalized();
  bool inside = true;
  double nearest = 1e300;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 edge = t[(i + 1) % 3] - t[i], to = p - t[i];
    inside = inside && normal.cross(edge).dot(to) >= 0.0;
    const double s = std::clamp(to.dot(edge) / edge.squaredNorm(), 0.0, 1.0);
    nearest = std::min(nearest, (to - edge * s).norm());
  }
  return inside ? std::abs(normal.dot(p - t[0])) : nearest;
}

double distance_to(const TriangleMesh& mesh, const Vec3& p) {
  double nearest = 1e300;
  for (const auto& t : mesh.triangles)
    nearest = std::min(
        nearest,
        distance_to({mesh.vertices_m[t[0]], mesh.vertices_m[t[1]], mesh.vertices_m[t[2]]}, p));
  return nearest;
}

// A capsule's distance is that of its segment.
double capsule_distance(const TriangleMesh& mesh, const Capsule& capsule, const BodyState& state) {
  double nearest = 1e300;
  for (int i = -100; i <= 100; ++i)
    nearest = std::min(
        nearest, distance_to(mesh, state.position_m + state.orientation *
                                                          Vec3(0, 0, 5e-3 * i * capsule.length_m)));
  return nearest - capsule.radius_m;
}

// The solid over the middle of the hills, turned anyhow.
World over_hills(const TriangleMesh& mesh, const Shape& shape, std::mt19937_64& random) {
  std::uniform_real_distribution<double> place(-1.0, 1.0);
  World world;
  world.add_static(world.add_shape(mesh));
  BodyState& state = world.add_body(world.add_shape(shape), Vec3(place(random), place(random), 0));
  state.orientation = random_rotation(random);
  return world;
}

// Lets the solid down until it is about as far from the hills as wanted; returns how far it is.
template <class Distance>
double let_down(double wanted_m, double from_m, BodyState& state, Distance distance) {
  state.position_m.z() = from_m;
  double left = distance() - wanted_m;
  for (int k = 0; k < 40 && left > 1e-5; ++k) {
    state.position_m.z() -= left;
    left = distance() - wanted_m;
  }
  return left + wanted_m;
}

double least_separation(const World& world) {
  double least = 1e300;
  for (const ContactManifold& m : test::contacts_of(world, kA, static_id(0)))
    for (std::uint32_t i = 0; i < m.count; ++i) least = std::min(least, m.points[i].separation_m);
  return least;
}

// Of contacts on edges and corners: off the mesh along the normal, nothing else of it is nearer.
void expect_normals_lead_away(const World& world, const TriangleMesh& mesh) {
  constexpr std::uint32_t kFirstEdgePart = 0x40000000u;
  constexpr double kStep_m = 1e-4;
  for (const ContactManifold& m : test::contacts_of(world, kA, static_id(0)))
    for (std::uint32_t i = 0; i < m.count && m.part >= kFirstEdgePart; ++i) {
      const Vec3 on_mesh = m.points[i].position_m + m.normal * (0.5 * m.points[i].separation_m);
      EXPECT_GT(distance_to(mesh, on_mesh - m.normal * kStep_m), 0.999 * kStep_m);
    }
}

constexpr double kRises_m[] = {0.02, 0.1, 0.3, 0.6};

TEST(Overlap, OfACapsuleWithHillsIsAsDeepAsItIs) {
  const Capsule capsule{0.25, 0.6};
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> depth(-0.04, 0.004);
  for (const double rise : kRises_m)
    for (int i = 0; i < 100; ++i) {
      const TriangleMesh mesh = hills(rise, random);
      World world = over_hills(mesh, capsule, random);
      BodyState& state = world.states[0];
      const double truth = let_down(depth(random), rise + 2.0, state,
                                    [&] { return capsule_distance(mesh, capsule, state); });
      EXPECT_NEAR(least_separation(world), truth, 5e-4) << "rise " << rise << ", trial " << i;
      expect_normals_lead_away(world, mesh);
    }
}

// Of triangles as solids of no thickness.
double solid_distance(const TriangleMesh& mesh, const CompiledShape& shape,
                      const BodyState& state) {
  const PlacedShape solid{shape, {state.orientation.toRotationMatrix(), state.position_m}};
  double nearest = 1e300;
  for (const auto& t : mesh.triangles) {
    CompiledShape triangle;
    triangle.kind = ShapeKind::kHull;
    for (const std::uint32_t v : t) triangle.vertices_m.push_back(mesh.vertices_m[v]);
    const PlacedShape placed{triangle, Pose{}};
    const CoreGap gap = core_gap({solid}, {placed}, -Vec3::UnitZ(), 1e-9);
    nearest = std::min(nearest, gap.overlap ? 0.0 : gap.distance_m);
  }
  return nearest;
}

TEST(Overlap, OfWhatIsJustAboveHillsIsNone) {
  std::mt19937_64 random(12);
  std::uniform_real_distribution<double> gap(5e-4, 2e-3);
  for (const Shape& shape : solids()) {
    if (std::holds_alternative<Capsule>(shape)) continue;
    const CompiledShape compiled = compile(shape);
    for (const double rise : kRises_m)
      for (int i = 0; i < 100; ++i) {
        const TriangleMesh mesh = hills(rise, random);
        World world = over_hills(mesh, shape, random);
        BodyState& state = world.states[0];
        const double truth = let_down(gap(random), rise + 2.0, state,
                                      [&] { return solid_distance(mesh, compiled, state); });
        EXPECT_NEAR(least_separation(world), truth, 1e-3)
            << "shape " << shape.index() << ", rise " << rise << ", trial " << i;
      }
  }
}

}  // namespace
}  // namespace soda::physics
