#include "physics/measures/measures.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

BodyState sample() {
  BodyState s;
  s.position_m = Vec3(1, 2, 3);
  s.orientation = Quat(0.5, 0.5, 0.5, 0.5);
  s.linear_velocity_m_s = Vec3(4, 5, 6);
  s.angular_velocity_rad_s = Vec3(7, 8, 9);
  s.impulses.push_back({static_cast<BodyId>(5), 1, 2, 3.0, Vec3(0.1, 0.2, 0.3)});
  return s;
}

struct Change {
  const char* field;
  std::function<void(BodyState&)> apply;
};

std::vector<Change> every_field() {
  return {
      {"position_m.x", [](BodyState& s) { s.position_m.x() += 1; }},
      {"position_m.y", [](BodyState& s) { s.position_m.y() += 1; }},
      {"position_m.z", [](BodyState& s) { s.position_m.z() += 1; }},
      {"orientation.w", [](BodyState& s) { s.orientation.w() += 1; }},
      {"orientation.x", [](BodyState& s) { s.orientation.x() += 1; }},
      {"orientation.y", [](BodyState& s) { s.orientation.y() += 1; }},
      {"orientation.z", [](BodyState& s) { s.orientation.z() += 1; }},
      {"linear_velocity_m_s.x", [](BodyState& s) { s.linear_velocity_m_s.x() += 1; }},
      {"linear_velocity_m_s.y", [](BodyState& s) { s.linear_velocity_m_s.y() += 1; }},
      {"linear_velocity_m_s.z", [](BodyState& s) { s.linear_velocity_m_s.z() += 1; }},
      {"angular_velocity_rad_s.x", [](BodyState& s) { s.angular_velocity_rad_s.x() += 1; }},
      {"angular_velocity_rad_s.y", [](BodyState& s) { s.angular_velocity_rad_s.y() += 1; }},
      {"angular_velocity_rad_s.z", [](BodyState& s) { s.angular_velocity_rad_s.z() += 1; }},
      {"impulses.size", [](BodyState& s) { s.impulses.push_back(s.impulses[0]); }},
      {"impulses.other", [](BodyState& s) { s.impulses[0].other = BodyId{6}; }},
      {"impulses.part", [](BodyState& s) { s.impulses[0].part++; }},
      {"impulses.feature", [](BodyState& s) { s.impulses[0].feature++; }},
      {"impulses.normal_newton_s", [](BodyState& s) { s.impulses[0].normal_newton_s += 1; }},
      {"impulses.friction_newton_s.x",
       [](BodyState& s) { s.impulses[0].friction_newton_s.x() += 1; }},
      {"impulses.friction_newton_s.y",
       [](BodyState& s) { s.impulses[0].friction_newton_s.y() += 1; }},
      {"impulses.friction_newton_s.z",
       [](BodyState& s) { s.impulses[0].friction_newton_s.z() += 1; }},
      {"broken_joints.size", [](BodyState& s) { s.broken_joints.push_back(3); }},
  };
}

TEST(Measures, EveryFieldCountsInIdentityDifferenceAndDigest) {
  const BodyState original = sample();
  const std::vector<BodyId> ids = {BodyId{3}};
  const std::uint64_t digest_before = digest(ids, std::vector{original});
  for (const Change& change : every_field()) {
    BodyState changed = original;
    change.apply(changed);
    EXPECT_FALSE(identical(original, changed)) << change.field;
    EXPECT_STREQ(first_difference(original, changed).field, change.field);
    EXPECT_NE(digest(ids, std::vector{changed}), digest_before) << change.field;
  }
  EXPECT_TRUE(identical(original, sample()));
  EXPECT_STREQ(first_difference(original, sample()).field, "");
  EXPECT_EQ(digest(ids, std::vector{sample()}), digest_before);
}

TEST(Measures, DifferenceGivesBothValues) {
  BodyState changed = sample();
  changed.position_m.y() = 2.5;
  const FieldDifference difference = first_difference(sample(), changed);
  EXPECT_EQ(difference.a, 2.0);
  EXPECT_EQ(difference.b, 2.5);
}

TEST(Measures, IdentityIsOfBits) {
  BodyState a = sample(), b = sample();
  a.position_m.x() = 0.0;
  b.position_m.x() = -0.0;
  EXPECT_FALSE(identical(a, b));
  a.position_m.x() = b.position_m.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(identical(a, b));
}

TEST(Measures, DigestDependsOnIdsAndOrder) {
  BodyState other = sample();
  other.position_m.x() = 9;
  const std::vector<BodyState> states = {sample(), other};
  const std::vector<BodyState> swapped = {other, sample()};
  const std::vector<BodyId> ids = {BodyId{1}, BodyId{2}}, others = {BodyId{1}, BodyId{3}};
  EXPECT_NE(digest(ids, states), digest(ids, swapped));
  EXPECT_NE(digest(ids, states), digest(others, states));
}

TEST(Measures, MechanicsOfASpinningBoxMatchTheTextbook) {
  test::World world = test::under_gravity();
  const std::uint32_t shape = world.add_shape(Box{Vec3(0.5, 1.0, 1.5)});
  BodyState& s = world.add_body(shape, Vec3(1, 2, 3), 100.0);  // 1 x 2 x 3 m: 600 kg
  s.orientation = test::about(Vec3::UnitZ(), M_PI / 2);        // local x is world y
  s.linear_velocity_m_s = Vec3(2, 0, 0);
  s.angular_velocity_rad_s = Vec3(0, 4, 0);
  const Mechanics m = world.mechanics();
  const double about_local_x = 600.0 / 12.0 * (4.0 + 9.0);
  EXPECT_NEAR(m.kinetic_energy_joule, 0.5 * 600 * 4 + 0.5 * about_local_x * 16, 1e-9);
  EXPECT_NEAR(m.potential_energy_joule, 600 * test::kGravity * 3, 1e-9);
  EXPECT_LT((m.linear_momentum_newton_s - Vec3(1200, 0, 0)).norm(), 1e-12);
  const Vec3 expected = Vec3(1, 2, 3).cross(Vec3(1200, 0, 0)) + Vec3(0, about_local_x * 4, 0);
  EXPECT_LT((m.angular_momentum_newton_m_s - expected).norm(), 1e-9);
  EXPECT_NEAR(m.momentum_scale_newton_s, 1200, 1e-12);
}

}  // namespace
}  // namespace soda::physics
