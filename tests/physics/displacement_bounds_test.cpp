// No body comes farther in a step than its speed, or that of what it is hit by, takes it.
#include "physics/constraints/displacement_bounds.hpp"

#include <gtest/gtest.h>

#include "tests/physics/pours.hpp"

namespace soda::physics::test {
namespace {

constexpr const char* kNames[] = {"spheres", "boxes", "capsules", "cylinders", "hulls", "all"};

// What goes wrong in `steps` steps: beyond what the fastest body before or after, gravity and
// position correction at its greatest speed explain; bodies behind a wall; energy that position
// correction at its greatest speed does not explain, for it lifts at most all of them at that
// speed.
struct Wrong {
  int displacements = 0, behind = 0, gains = 0, faults = 0;
};

Wrong run_pour(const Pour& pour, int steps) {
  World world = poured(pour);
  const Geometry geometry(world.scene);
  const double dt_s = world.scene.dt_s, pushed_m_s = fastest_correction(world.scene, world.ids).m_s;
  double mass_kg = 0.0;
  for (const BodyParams& body : world.scene.bodies) mass_kg += body.mass_kg;
  Wrong wrong;
  for (int i = 0; i < steps; ++i) {
    const std::vector<BodyState> before = world.states;
    const Mechanics was = world.mechanics();
    world.run(1, geometry);
    wrong.faults += static_cast<int>(world.report.faults.size());
    double fastest_m_s = 0.0;
    for (std::size_t b = 0; b < before.size(); ++b)
      fastest_m_s = std::max({fastest_m_s, before[b].linear_velocity_m_s.norm(),
                              world.states[b].linear_velocity_m_s.norm()});
    for (std::size_t b = 0; b < before.size(); ++b) {
      const Vec3& place_m = world.states[b].position_m;
      const double displacement_m = (place_m - before[b].position_m).norm();
      wrong.displacements += displacement_m > dt_s * (fastest_m_s + kGravity * dt_s + pushed_m_s);
      wrong.behind += place_m.z() < 0.0 || place_m.head<2>().cwiseAbs().maxCoeff() > kPourWall_m;
    }
    const Mechanics now = world.mechanics();
    const double gain_joule = now.kinetic_energy_joule + now.potential_energy_joule -
                              was.kinetic_energy_joule - was.potential_energy_joule;
    wrong.gains += gain_joule >
                   1e-9 * was.potential_energy_joule + 0.1 * mass_kg * kGravity * pushed_m_s * dt_s;
  }
  return wrong;
}

TEST(DisplacementBounds, OfBodiesThatArePouredIntoABoxAreThoseOfTheirSpeeds) {
  for (const Poured kind : {Poured::kSpheres, Poured::kBoxes, Poured::kCapsules, Poured::kCylinders,
                            Poured::kHulls, Poured::kMixed})
    for (const double restitution : {0.0, 0.3, 0.6, 0.9}) {
      SCOPED_TRACE(std::string(kNames[static_cast<int>(kind)]) + " of restitution " +
                   std::to_string(restitution));
      const Wrong wrong = run_pour({.kind = kind, .bodies = 40, .restitution = restitution}, 40);
      EXPECT_EQ(wrong.displacements, 0);
      EXPECT_EQ(wrong.behind, 0);
      EXPECT_EQ(wrong.gains, 0);
      EXPECT_EQ(wrong.faults, 0);
    }
}

// The next step starts from them: an impulse beyond what stops everything throws bodies.
TEST(DisplacementBounds, ImpulsesThatAStepLeavesAreNoLargerThanWhatStopsAllBodies) {
  const auto expect_no_larger = [](int bodies, std::uint64_t seed) {
    World world = poured({.kind = Poured::kBoxes, .bodies = bodies, .seed = seed});
    const Geometry geometry(world.scene);
    const auto motion_newton_s = [&world] {
      double sum = 0.0;
      for (std::size_t b = 0; b < world.states.size(); ++b)
        sum += world.scene.bodies[b].mass_kg *
               (world.states[b].linear_velocity_m_s.norm() + kGravity * world.scene.dt_s);
      return sum;
    };
    for (int i = 0; i < 60; ++i) {
      const double before = motion_newton_s();
      world.run(1, geometry);
      const double most = 0.5 * (before + motion_newton_s());
      for (const BodyState& state : world.states)
        for (const ContactImpulse& impulse : state.impulses)
          ASSERT_LE(impulse.normal_newton_s, most) << "seed " << seed << ", step " << i;
    }
  };
  for (std::uint64_t seed = 1; seed <= 10; ++seed) expect_no_larger(5, seed);
  expect_no_larger(40, 5);
}

TEST(DisplacementBounds, OfAPourAreThoseOfItsSpeedsAtAnyStepAndNumber) {
  for (const double rate_hz : {30.0, 120.0, 240.0})
    for (const int bodies : {20, 80}) {
      SCOPED_TRACE(std::to_string(bodies) + " bodies at " + std::to_string(rate_hz) + " Hz");
      const Wrong wrong =
          run_pour({.bodies = bodies, .dt_s = 1.0 / rate_hz}, static_cast<int>(0.5 * rate_hz));
      EXPECT_EQ(wrong.displacements, 0);
      EXPECT_EQ(wrong.behind, 0);
      EXPECT_EQ(wrong.gains, 0);
      EXPECT_EQ(wrong.faults, 0);
    }
}

// Balls of .6 restitution that fall through rows of pins.
TEST(DisplacementBounds, OfBallsInAGaltonBoardAreThoseOfTheirSpeeds) {
  World world = under_gravity();
  world.scene.dt_s = 1.0 / 60.0;
  const Material material{.friction = 0.2, .restitution = 0.6};
  world.add_floor(material);
  world.add_static(world.add_shape(HalfSpace{Vec3(0, 1, 0), -0.02}), Vec3::Zero(), Quat::Identity(),
                   material);
  world.add_static(world.add_shape(HalfSpace{Vec3(0, -1, 0), -0.02}), Vec3::Zero(),
                   Quat::Identity(), material);
  const std::uint32_t pin = world.add_shape(Sphere{0.01}), ball = world.add_shape(Sphere{0.015});
  for (int row = 0; row < 6; ++row)
    for (int i = -4; i <= 4; ++i)
      world.add_static(pin, Vec3(0.08 * (i + 0.5 * (row % 2)), 0, 0.4 + 0.07 * row),
                       Quat::Identity(), material);
  for (int i = 0; i < 60; ++i)
    world.add_body(
        ball,
        Vec3(0.032 * (i % 6 - 2.5) + 1e-3 * (i / 6), 1e-3 * (i % 5 - 2), 0.85 + 0.032 * (i / 6)),
        2000.0, material);
  const Geometry geometry(world.scene);
  const double pushed_m_s = fastest_correction(world.scene, world.ids).m_s;
  for (int i = 0; i < 120; ++i) {
    const std::vector<BodyState> before = world.states;
    world.run(1, geometry);
    ASSERT_TRUE(world.report.faults.empty()) << i;
    double fastest_m_s = 0.0;
    for (std::size_t b = 0; b < before.size(); ++b)
      fastest_m_s = std::max({fastest_m_s, before[b].linear_velocity_m_s.norm(),
                              world.states[b].linear_velocity_m_s.norm()});
    for (std::size_t b = 0; b < before.size(); ++b)
      ASSERT_LE((world.states[b].position_m - before[b].position_m).norm(),
                world.scene.dt_s * (fastest_m_s + kGravity * world.scene.dt_s + pushed_m_s))
          << "step " << i << ", ball " << b;
  }
}

TEST(DisplacementBounds, OfOverlapsThatArePushedOutAreBounded) {
  World world = under_gravity();
  world.scene.dt_s = 1.0 / 60.0;
  world.add_floor();
  const std::uint32_t box = world.add_shape(Box{});
  for (int i = 0; i < 10; ++i) world.add_body(box, Vec3(0, 0, 0.5));
  const double most_m_s = fastest_correction(world.scene, world.ids).m_s;
  EXPECT_EQ(most_m_s, 2.0);
  const Geometry geometry(world.scene);
  for (int i = 0; i < 600; ++i) {
    const std::vector<BodyState> before = world.states;
    world.run(1, geometry);
    ASSERT_TRUE(world.report.faults.empty()) << i;
    for (std::size_t b = 0; b < before.size(); ++b) {
      const double speed_m_s = std::max(before[b].linear_velocity_m_s.norm(),
                                        world.states[b].linear_velocity_m_s.norm());
      ASSERT_LE((world.states[b].position_m - before[b].position_m).norm(),
                world.scene.dt_s * (speed_m_s + kGravity * world.scene.dt_s + most_m_s))
          << "step " << i << ", box " << b;
    }
  }
  for (const IslandReport& island : world.report.islands) EXPECT_LT(island.max_penetration_m, 0.01);
}

// In flight, and pressed on the ground by a driven body, where iterations bring the rebound about.
TEST(DisplacementBounds, APairBouncesAsTheBouncierOfTheTwo) {
  for (const bool pushed : {false, true}) {
    World world;
    world.scene.dt_s = 0.01;
    world.add_floor(Material{.friction = 0.0, .restitution = 0.0});
    BodyState& ball = world.add_body(world.add_shape(Sphere{0.5}), Vec3(0, 0, 0.5005), 1.0,
                                     Material{.friction = 0.0, .restitution = 0.5});
    ball.linear_velocity_m_s = Vec3(0, 0, -2.0);
    if (pushed) world.scene.bodies[0].own_field_m_s2 = Vec3(1e-12, 0, 0);
    world.run(1);
    EXPECT_NEAR(world.states[0].linear_velocity_m_s.z(), 1.0, 1e-9) << pushed;
  }
}

TEST(DisplacementBounds, PositionCorrectionIsShortenedInItsDirection) {
  PositionCorrection correction{Vec3(3.0, 0.0, 4.0), Vec3(0.0, 8.0, 0.0)};
  limit_correction({2.5, 4.0}, correction);
  EXPECT_NEAR((correction.linear - Vec3(1.5, 0.0, 2.0)).norm(), 0.0, 1e-15);
  EXPECT_NEAR((correction.angular - Vec3(0.0, 4.0, 0.0)).norm(), 0.0, 1e-15);
  const PositionCorrection slow{Vec3(1.0, 0.0, 0.0), Vec3(0.0, 1.0, 0.0)};
  PositionCorrection same = slow;
  limit_correction({2.5, 4.0}, same);
  EXPECT_EQ(same.linear, slow.linear);
  EXPECT_EQ(same.angular, slow.angular);
}

// Of 1 kg, one at 3 m/s: neither can be faster than that.
World two_balls() {
  World world;
  world.scene.dt_s = 0.1;
  const std::uint32_t ball = world.add_shape(Sphere{0.5});
  const double density = 1.0 / mass_properties(world.scene.shapes[ball]).volume_m3;
  world.add_body(ball, Vec3(-1, 0, 0), density).linear_velocity_m_s = Vec3(3.0, 0, 0);
  world.add_body(ball, Vec3(0, 0, 0), density);
  return world;
}

TEST(DisplacementBounds, MoreThanEnergyAndPositionCorrectionAllowIsAFault) {
  const World world = two_balls();
  DisplacementBounds bounds;
  bound_displacements(world.scene, world.scene.dt_s, world.ids, {}, world.states, bounds);
  std::vector<AdvanceFault> faults;
  const auto moved = [&](double displacement_m) {
    BodyState state = world.states[1];
    state.position_m.x() += displacement_m;
    faults.clear();
    report_impossible_displacement(world.scene, bounds, 1, BodyId{1}, state, faults);
    return faults.size();
  };
  constexpr double kMost_m = 0.1 * (3.0 + 2.0);
  EXPECT_EQ(moved(kMost_m - 1e-6), 0u);
  EXPECT_EQ(moved(kMost_m * (1.0 + 1e-14)), 0u);  // rounding
  ASSERT_EQ(moved(kMost_m + 1e-6), 1u);
  EXPECT_EQ(faults[0].body, BodyId{1});
  EXPECT_EQ(
      faults[0].what,
      "moves 0.500001 m in one step; the energy of its island and position correction allow 0.5 m");
}

// Of velocities that were solved for, and are more than energy allows.
TEST(DisplacementBounds, LetBodiesComeAsFarAsTheirEnergyDoes) {
  const World world = two_balls();
  DisplacementBounds bounds;
  bound_displacements(world.scene, world.scene.dt_s, world.ids, {}, world.states, bounds);
  std::vector<SolverBody> bodies(3);
  const auto share = [&] { return share_within(world.scene, bounds, world.ids, bodies); };
  bodies[1].linear = Vec3(3.0, 0, 0);
  EXPECT_EQ(share(), 1.0);
  bodies[1].linear = Vec3(0, 4.0, 0);
  EXPECT_NEAR(share(), 0.75, 1e-12);
  bounds.any = false;
  EXPECT_EQ(share(), 1.0);
}

}  // namespace
}  // namespace soda::physics::test
