// Bodies of several convex parts.
#include "tests/physics/compounds.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace soda::physics::test {
namespace {

TEST(CompoundMass, OfADumbbellIsTheClosedForm) {
  World world;
  const double r = 0.1, d = 0.4;
  const std::uint32_t ball = world.add_shape(Sphere{r});
  const Compound dumbbell{
      {{ball, Vec3(0, 0, -d), Quat::Identity()}, {ball, Vec3(0, 0, d), Quat::Identity()}}};
  const MassProperties mass = mass_properties(dumbbell, world.scene.shapes);
  const double one = 4.0 / 3.0 * std::numbers::pi * r * r * r;
  EXPECT_NEAR(mass.volume_m3, 2 * one, 1e-15);
  EXPECT_NEAR(mass.inertia_per_density_m5(2, 2), 2 * 0.4 * one * r * r, 1e-16);
  EXPECT_NEAR(mass.inertia_per_density_m5(0, 0), 2 * one * (0.4 * r * r + d * d), 1e-16);
  EXPECT_NEAR(mass.center_local_m.norm(), 0.0, 1e-16);
}

TEST(CompoundMass, OfATurnedLIsThatOfItsBars) {
  // A bar along x and one along y from its end, turned by a part's orientation.
  World world;
  const std::uint32_t bar = world.add_shape(Box{Vec3(0.5, 0.1, 0.1)});
  const Compound shape{{{bar, Vec3(0.5, 0, 0), Quat::Identity()},
                        {bar, Vec3(0, 0.6, 0), about(Vec3::UnitZ(), std::numbers::pi / 2)}}};
  const MassProperties mass = mass_properties(shape, world.scene.shapes);
  EXPECT_NEAR(mass.volume_m3, 0.08, 1e-15);
  EXPECT_NEAR((mass.center_local_m - Vec3(0.25, 0.3, 0)).norm(), 0.0, 1e-15);
  const double v = 0.04, thin = v * (0.01 + 0.01) / 3, wide = v * (0.25 + 0.01) / 3;
  // Each centre is (+-.25, +-.3) from the whole's.
  EXPECT_NEAR(mass.inertia_per_density_m5(0, 0), thin + wide + 2 * v * 0.09, 1e-15);
  EXPECT_NEAR(mass.inertia_per_density_m5(1, 1), thin + wide + 2 * v * 0.0625, 1e-15);
  EXPECT_NEAR(mass.inertia_per_density_m5(2, 2), 2 * wide + 2 * v * 0.1525, 1e-15);
  EXPECT_NEAR(mass.inertia_per_density_m5(0, 1), 2 * v * 0.075, 1e-15);
}

TEST(CompoundMass, OfABoxInEightIsThatOfTheBox) {
  World world;
  const Compound parts = box_in_eight(world, Vec3(0.3, 0.2, 0.5));
  const MassProperties cut = mass_properties(parts, world.scene.shapes),
                       whole = mass_properties(Box{Vec3(0.3, 0.2, 0.5)});
  EXPECT_NEAR(cut.volume_m3, whole.volume_m3, 1e-15);
  EXPECT_LT((cut.inertia_per_density_m5 - whole.inertia_per_density_m5).norm(), 1e-15);
}

// Solids, some of which are turned; and what they meet.
std::vector<Shape> solids() {
  const std::vector<Vec3> corners{
      {0.3, 0, -0.1}, {-0.2, 0.3, -0.1}, {-0.2, -0.3, -0.1}, {0, 0, 0.4}};
  ConvexHull hull = std::get<ConvexHull>(make_convex_hull(corners));
  const Vec3 centre = mass_properties(hull).center_local_m;
  for (Vec3& v : hull.vertices_m) v -= centre;
  return {Sphere{0.3}, Box{Vec3(0.3, 0.2, 0.4)}, Capsule{0.2, 0.4}, Cylinder{0.25, 0.5}, hull};
}

std::vector<ContactManifold> contacts_at(const Shape& shape, bool as_part, const Shape& other,
                                         const BodyState& state) {
  World world = under_gravity();
  std::uint32_t index = world.add_shape(shape);
  if (as_part) index = world.add_shape(Compound{{{index, Vec3::Zero(), Quat::Identity()}}});
  world.add_body(index, Vec3::Zero()) = state;
  world.add_static(world.add_shape(other), Vec3(0, 0, -1));
  return contacts_of(world, BodyId{0}, static_id(0));
}

TEST(Compounds, OfOnePartMeetsAsThatPart) {
  const TriangleMesh ground{{{-5, -5, 1}, {5, -5, 1}, {5, 5, 1}, {-5, 5, 1.2}},
                            {{0, 1, 2}, {0, 2, 3}}};
  std::vector<Shape> others = solids();
  others.insert(others.end(), {Shape(HalfSpace{Vec3::UnitZ(), 1.0}), Shape(ground)});
  std::size_t met = 0;
  for (const Shape& shape : solids())
    for (const Shape& other : others)
      for (int i = 0; i < 40; ++i) {
        BodyState state;
        const bool flat =
            std::holds_alternative<TriangleMesh>(other) || std::holds_alternative<HalfSpace>(other);
        state.position_m = Vec3(0.03 * i, 0.01 * i, (flat ? 0.1 : -0.9) + 0.02 * i);
        state.orientation = about(Vec3(1, 0.3 * i, 2), 0.2 * i);
        state.linear_velocity_m_s = Vec3(0, 1, i % 4 == 0 ? -60.0 : -1.0);
        state.angular_velocity_rad_s = Vec3(1, 0, i % 3);
        const auto alone = contacts_at(shape, false, other, state);
        const auto part = contacts_at(shape, true, other, state);
        ASSERT_EQ(alone.size(), part.size())
            << shape.index() << " on " << other.index() << ", " << i;
        for (std::size_t m = 0; m < alone.size(); ++m) {
          ++met;
          EXPECT_EQ(alone[m].part, part[m].part);
          ASSERT_EQ(alone[m].count, part[m].count);
          EXPECT_LT((alone[m].normal - part[m].normal).norm(), 1e-12);
          for (std::uint32_t p = 0; p < alone[m].count; ++p) {
            EXPECT_LT((alone[m].points[p].position_m - part[m].points[p].position_m).norm(), 1e-12);
            EXPECT_NEAR(alone[m].points[p].separation_m, part[m].points[p].separation_m, 1e-12);
          }
        }
      }
  EXPECT_GT(met, 500u);
}

TEST(Compounds, PartsOfContactsAreTheirPairs) {
  World world;
  const Compound two = dumbbell(world, 0.1, 0.4);
  const std::uint32_t shape = world.add_shape(two);
  world.add_body(shape, Vec3::Zero());
  world.add_body(shape, Vec3(0.195, 0, 0));
  const auto found = contacts_of(world, BodyId{0}, BodyId{1});
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].part, 0u);
  EXPECT_EQ(found[1].part, 3u);
  for (const ContactManifold& m : found) EXPECT_NEAR(m.points[0].separation_m, -0.005, 1e-14);
}

// The same start, whole and cut in eight.
struct Twins {
  World whole = under_gravity(), cut = under_gravity();

  explicit Twins(const Vec3& half, Material material = {}) {
    const std::uint32_t box = whole.add_shape(Box{half});
    whole.add_body(box, Vec3::Zero(), 1000.0, material);
    cut.add_body(cut.add_shape(box_in_eight(cut, half)), Vec3::Zero(), 1000.0, material);
  }
  template <class Change>
  void both(Change change) {
    change(whole);
    change(cut);
  }
};

TEST(Compounds, ABoxInEightFliesAsTheBox) {
  Twins twins(Vec3(0.3, 0.2, 0.5));
  twins.both([](World& w) {
    w.states[0].angular_velocity_rad_s = Vec3(1, 5, 0.3);
    w.states[0].linear_velocity_m_s = Vec3(3, 0, 4);
    w.run(300);
  });
  EXPECT_EQ(twins.whole.states[0].position_m, twins.cut.states[0].position_m);
  EXPECT_LT(twins.whole.states[0].orientation.angularDistance(twins.cut.states[0].orientation),
            1e-10);
}

TEST(Compounds, ABoxInEightRestsWhereItIs) {
  for (const double tilt : {0.0, 0.2}) {
    Twins twins(Vec3(0.3, 0.2, 0.5), {.friction = 0.6});
    const Quat rotation = about(Vec3::UnitX(), tilt);
    twins.both([&](World& w) {
      w.add_static(w.add_shape(HalfSpace{}), Vec3::Zero(), rotation, {.friction = 0.6});
      w.states[0].orientation = rotation;
      w.states[0].position_m = rotation * Vec3(0, 0, 0.5);
      w.run(600);
      EXPECT_LT((w.states[0].position_m - rotation * Vec3(0, 0, 0.5)).norm(), 1e-6) << tilt;
      EXPECT_LT(w.states[0].linear_velocity_m_s.norm(), 1e-9);
    });
  }
}

TEST(Compounds, ABoxInEightBouncesAsTheBox) {
  for (const double speed : {0.5, 5.0, 50.0}) {
    Twins twins(Vec3(0.3, 0.2, 0.5), {.friction = 0.3, .restitution = 0.5});
    twins.both([&](World& w) {
      w.add_floor({.friction = 0.3, .restitution = 0.5});
      w.states[0].position_m = Vec3(0, 0, 1.0);
      w.states[0].orientation = about(Vec3(1, 2, 0), 0.4);
      w.states[0].linear_velocity_m_s = Vec3(1, 0, -speed);
      w.run(60);
    });
    const BodyState &a = twins.whole.states[0], &b = twins.cut.states[0];
    EXPECT_LT((a.linear_velocity_m_s - b.linear_velocity_m_s).norm(), 1e-3 * speed) << speed;
    EXPECT_LT((a.position_m - b.position_m).norm(), 1e-3 * speed) << speed;
  }
}

}  // namespace
}  // namespace soda::physics::test
