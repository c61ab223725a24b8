// Joints beside contacts refined to a tolerance: the order of the method.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "tests/physics/joints.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::kGravity;
using test::under_gravity;
using test::World;

constexpr double kCart_kg = 8.0, kWeight_kg = 2.0, kRod_m = 0.5, kStart_rad = 0.6;
constexpr double kRadius_m = 0.1, kDuration_s = 0.5;
constexpr Material kSmooth{.friction = 0.0, .restitution = 0.0};
constexpr Material kRough{.friction = 1.0, .restitution = 0.0};

// A cart on a floor, and a sphere on a rigid rod below a joint above its middle.
World cart_with_pendulum(double cart_kg, const Material& floor) {
  World world = under_gravity();
  world.add_floor(floor);
  const Vec3 half(1.0, 1.0, 0.1), anchor(0, 0, 1.0);
  world.add_body(world.add_shape(Box{half}), Vec3(0, 0, 0.1),
                 cart_kg / (8.0 * half.x() * half.y() * half.z()), floor);
  const double volume = 4.0 / 3.0 * M_PI * kRadius_m * kRadius_m * kRadius_m;
  const Vec3 weight = anchor + kRod_m * Vec3(std::sin(kStart_rad), 0, -std::cos(kStart_rad));
  world.add_body(world.add_shape(Sphere{kRadius_m}), weight, kWeight_kg / volume, kSmooth);
  test::add(world, test::joint_at(JointKind::kBall, world, 0, 1, anchor));
  return world;
}

using Phase = std::array<double, 4>;  // displacement of the cart, angle of the rod, their rates

// (M + m) x'' + m l (a'' cos a - a'^2 sin a) = 0, (I + m l^2) a'' + m l cos a x'' = -m g l sin a.
Phase rate_of(const Phase& at, double cart_kg) {
  const double sine = std::sin(at[1]), cosine = std::cos(at[1]), ml = kWeight_kg * kRod_m;
  const double a11 = cart_kg + kWeight_kg, a12 = ml * cosine;
  const double a22 = 0.4 * kWeight_kg * kRadius_m * kRadius_m + ml * kRod_m;
  const double b1 = ml * at[3] * at[3] * sine, b2 = -ml * kGravity * sine;
  const double determinant = a11 * a22 - a12 * a12;
  return {at[2], at[3], (b1 * a22 - a12 * b2) / determinant, (a11 * b2 - a12 * b1) / determinant};
}

// By the classical Runge-Kutta method: to 1e-13.
Phase moved_exactly(Phase at, double time_s, double cart_kg) {
  constexpr double kLongest_s = 0.5 / 4000;
  const int steps = static_cast<int>(std::ceil(time_s / kLongest_s));
  const double step_s = time_s / steps;
  const auto moved = [](const Phase& from, const Phase& rate, double part_s) {
    Phase to = from;
    for (std::size_t i = 0; i < to.size(); ++i) to[i] += part_s * rate[i];
    return to;
  };
  for (int i = 0; i < steps; ++i) {
    const Phase k1 = rate_of(at, cart_kg), k2 = rate_of(moved(at, k1, 0.5 * step_s), cart_kg);
    const Phase k3 = rate_of(moved(at, k2, 0.5 * step_s), cart_kg);
    const Phase k4 = rate_of(moved(at, k3, step_s), cart_kg);
    for (std::size_t k = 0; k < at.size(); ++k)
      at[k] += step_s / 6.0 * (k1[k] + 2.0 * (k2[k] + k3[k]) + k4[k]);
  }
  return at;
}

struct Outcome {
  double error_m = 0.0;
  std::uint64_t refined_steps = 0;
  bool reached = true;
};

Outcome run(double dt_s, double tolerance) {
  World world = cart_with_pendulum(kCart_kg, kSmooth);
  world.scene.dt_s = dt_s;
  world.scene.tolerance = tolerance;
  const Geometry geometry(world.scene);
  Outcome outcome;
  for (int i = 0; i < static_cast<int>(std::lround(kDuration_s / dt_s)); ++i) {
    world.run(1, geometry);
    for (const IslandReport& island : world.report.islands)
      outcome.reached = outcome.reached && !island.beyond_tolerance;
  }
  outcome.refined_steps = world.counters.refined_steps;
  const Phase exact = moved_exactly({0.0, kStart_rad, 0.0, 0.0}, kDuration_s, kCart_kg);
  const Vec3 weight(exact[0] + kRod_m * std::sin(exact[1]), 0, 1.0 - kRod_m * std::cos(exact[1]));
  outcome.error_m = std::max((world.states[0].position_m - Vec3(exact[0], 0, 0.1)).norm(),
                             (world.states[1].position_m - weight).norm());
  return outcome;
}

double log2_ratio(double from, double to) { return std::log2(from / to); }

// One, two and four steps over each step, at these lengths and tolerances, and no halving.
TEST(JointedOrder, IsTheSecondAtLeastInTheStepInAccuracyMode) {
  constexpr std::uint64_t kTrials = 1 + 2 + 4 - 1;
  std::vector<Outcome> outcomes;
  for (const auto& [dt_s, tolerance] :
       {std::pair(1.0 / 40.0, 1e-3), std::pair(1.0 / 80.0, 1e-3), std::pair(1.0 / 160.0, 1e-4)}) {
    outcomes.push_back(run(dt_s, tolerance));
    ASSERT_EQ(outcomes.back().refined_steps,
              kTrials * static_cast<std::uint64_t>(std::lround(kDuration_s / dt_s)));
    EXPECT_TRUE(outcomes.back().reached);
  }
  for (std::size_t i = 1; i < outcomes.size(); ++i)
    EXPECT_GE(log2_ratio(outcomes[i - 1].error_m, outcomes[i].error_m), 2.0) << i;
}

// The same of what it costs: twice the steps, a quarter of the error or less.
TEST(JointedOrder, IsTheSecondAtLeastInTheNumberOfSolves) {
  Outcome coarse = run(1.0 / 20.0, 1e-2);
  for (const double tolerance : {1e-4, 1e-6, 1e-7}) {
    const Outcome fine = run(1.0 / 20.0, tolerance);
    EXPECT_TRUE(fine.reached) << tolerance;
    EXPECT_GE(log2_ratio(coarse.error_m, fine.error_m),
              2.0 * log2_ratio(static_cast<double>(fine.refined_steps),
                               static_cast<double>(coarse.refined_steps)))
        << tolerance;
    EXPECT_LE(fine.error_m, tolerance * 2.0 * kRadius_m * kDuration_s * 20.0) << tolerance;
    coarse = fine;
  }
}

// The largest over this time: a single one can be where errors pass zero.
double largest_error_m(double dt_s, double duration_s, World world, double cart_kg) {
  world.scene.dt_s = dt_s;
  const Geometry geometry(world.scene);
  double largest = 0.0;
  Phase exact{0.0, kStart_rad, 0.0, 0.0};
  for (int i = 0; i < static_cast<int>(std::lround(duration_s / dt_s)); ++i) {
    world.run(1, geometry);
    exact = moved_exactly(exact, dt_s, cart_kg);
    const Vec3 weight(exact[0] + kRod_m * std::sin(exact[1]), 0, 1.0 - kRod_m * std::cos(exact[1]));
    largest = std::max(largest, (world.states[1].position_m - weight).norm());
  }
  return largest;
}

TEST(JointedOrder, OfWhatHangsFromABodyThatRestsIsTheSecondWithoutATolerance) {
  constexpr double kStand_kg = 500.0, kImmovable_kg = 1e9, kLong_s = 2.0;
  const auto error_m = [](double dt_s) {
    return largest_error_m(dt_s, kLong_s, cart_with_pendulum(kStand_kg, kRough), kImmovable_kg);
  };
  const double order = log2_ratio(error_m(1.0 / 80.0), error_m(1.0 / 160.0));
  EXPECT_GE(order, 1.9);
  EXPECT_LE(order, 2.3);
}

// What touches something and moves does so by its velocity at the end of the step.
TEST(JointedOrder, OfWhatHangsFromABodyThatSlidesIsTheFirstWithoutATolerance) {
  constexpr double kLong_s = 2.0, kMost_m = 0.01;
  const auto error_m = [](double dt_s) {
    return largest_error_m(dt_s, kLong_s, cart_with_pendulum(kCart_kg, kSmooth), kCart_kg);
  };
  const double coarse = error_m(1.0 / 80.0), order = log2_ratio(coarse, error_m(1.0 / 160.0));
  EXPECT_GE(order, 0.9);
  EXPECT_LE(coarse, kMost_m);
}

}  // namespace
}  // namespace soda::physics
