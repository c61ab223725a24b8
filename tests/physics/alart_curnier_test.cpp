#include "physics/solvers/alart_curnier.hpp"

#include <gtest/gtest.h>

#include <random>
#include <utility>

namespace soda::physics {
namespace {

constexpr double kStep_m_s = 9.81 / 60.0;  // that gravity gives in a step

// Unit cubes of 1 kg on each other, on a floor, which push to the side; none rotates freely.
struct Stack {
  ConvexContacts problem;
  std::vector<Vec3> targets;
  Elimination plan;
};

Stack stack_of(std::uint32_t cubes, double friction, double sideways_m_s) {
  Stack stack;
  std::vector<std::array<std::uint32_t, 2>> edges;
  for (std::uint32_t i = 0; i < cubes; ++i) {
    stack.problem.bodies.push_back({1.0, Mat3(Mat3::Identity() / 6.0)});
    stack.problem.free.push_back({Vec3(sideways_m_s * (i + 1), 0.1 * i, -kStep_m_s), Vec3::Zero()});
    if (i > 0) edges.push_back({i - 1, i});
  }
  stack.problem.compliance_1_kg = 1.0 / cubes;
  for (std::uint32_t i = 0; i < cubes; ++i)
    for (const double x : {-0.5, 0.5})
      for (const double y : {-0.5, 0.5}) {
        ConvexPoint p;
        p.a = i;
        p.b = i == 0 ? cubes : i - 1;  // what lies below; the normal points to it
        p.normal = -Vec3::UnitZ();
        p.arm_a = Vec3(x, y, -0.5);
        p.arm_b = Vec3(x, y, 0.5);
        p.friction = friction;
        stack.problem.points.push_back(p);
      }
  stack.targets.assign(stack.problem.points.size(), Vec3::Zero());
  stack.plan = *plan_elimination(cubes, edges, 1e9);
  return stack;
}

NewtonLimits limits_of(double scale_m_s) {
  return {scale_m_s, 1e-12 * scale_m_s, 1e-10 * scale_m_s, 1e-7 * scale_m_s, 100, 40};
}

// How far the contact laws are from fulfilled, in m/s: closing, parting under load, and friction
// that is not against the slip.
double off_laws_m_s(const ConvexContacts& problem, const std::vector<Twist>& twists,
                    const Responses& responses) {
  double off = 0.0;
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    const ConvexPoint& p = problem.points[i];
    const Vec3 velocity = relative_velocity(p, twists);
    const Vec3& impulse = responses.points[i].impulse_newton_s;
    const double normal = impulse.dot(p.normal), parting = velocity.dot(p.normal);
    off = std::max(off, normal > 0.0 ? std::abs(parting) : -parting);
    const Vec3 slip = velocity - p.normal * parting, friction = impulse - p.normal * normal;
    off = std::max(off, (slip * (p.friction * normal) + friction * slip.norm()).norm());
  }
  return off;
}

TEST(AlartCurnier, FulfilsTheLawsInFewFactorisationsFromNearTheirSolution) {
  for (const std::uint32_t cubes : {1u, 2u, 5u}) {
    SCOPED_TRACE(cubes);
    Stack stack = stack_of(cubes, 0.3, 0.5);
    std::vector<Twist> twists = stack.problem.free;
    Responses responses;
    ASSERT_TRUE(
        solve_by_newton(limits_of(1.0), stack.plan, stack.problem, twists, responses).converged);
    for (PointResponse& response : responses.points) response.impulse_newton_s *= 1.01;
    for (Twist& twist : twists) twist.linear *= 1.01;
    const NewtonLimits limits = limits_of(1.0);
    BodyBlocks bodies;
    AlartCurnier exact(limits, stack.plan, stack.problem, bodies, stack.targets);
    ASSERT_TRUE(exact.solve(100, 100, twists, responses));
    EXPECT_LE(exact.factorisations(), 4);
    EXPECT_LE(off_laws_m_s(stack.problem, twists, responses), 1e-10);
  }
}

// A cube that a weak or a strong motor pulls over a floor that it sticks to: with each correction
// the motor pulls by one newton second more, until it can no more, or the cube slides.
TEST(AlartCurnier, WhatGrowsWithEachCorrectionGrowsAtOnceUntilSomethingLetsGo) {
  for (const double most_newton_s : {5.0, 50.0}) {
    SCOPED_TRACE(most_newton_s);
    Stack stack = stack_of(1, 0.5, 0.0);
    stack.problem.free[0].linear.z() = -60.0;  // pressed: friction of 30 N s at most
    stack.problem.compliance_1_kg = 1e-3;
    ConvexRow& motor = stack.problem.rows.emplace_back();
    motor.a = 0;
    motor.b = 1;
    motor.linear = Vec3::UnitX();
    motor.target_m_s = 1e-3;
    motor.stiffness_kg = 1e3;
    motor.least_newton_s = -most_newton_s;
    motor.most_newton_s = most_newton_s;
    std::vector<Twist> twists(1);
    Responses responses;
    responses.points.resize(4);
    responses.rows.resize(1);
    for (PointResponse& response : responses.points) response.impulse_newton_s = Vec3(0, 0, -15.0);
    const NewtonLimits limits = limits_of(1.0);
    BodyBlocks bodies;
    AlartCurnier exact(limits, stack.plan, stack.problem, bodies, stack.targets);
    ASSERT_TRUE(exact.solve(100, 100, twists, responses));
    EXPECT_LE(exact.factorisations(), 8);
    EXPECT_LE(off_laws_m_s(stack.problem, twists, responses), 1e-9);
    const double pulled_newton_s = most_newton_s < 30.0 ? most_newton_s : 30.0 + 1e-3;
    EXPECT_NEAR(responses.rows[0].impulse_newton_s, pulled_newton_s, 1e-9);
  }
}

// Points that open and close together would do so for ever with whole steps.
TEST(AlartCurnier, StepsThatLeadAwayAreShortened) {
  std::mt19937_64 random(1);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53 - 0.5; };
  int solved = 0;
  for (int i = 0; i < 200; ++i) {
    Stack stack = stack_of(4, 0.4, 0.3);
    for (Twist& twist : stack.problem.free) {
      twist.linear += Vec3(unit(), unit(), unit());
      twist.angular += Vec3(unit(), unit(), unit());
    }
    std::vector<Twist> twists = stack.problem.free;
    Responses responses;
    responses.points.resize(stack.problem.points.size());
    const NewtonLimits limits = limits_of(1.0);
    BodyBlocks bodies;
    AlartCurnier exact(limits, stack.plan, stack.problem, bodies, stack.targets);
    if (!exact.solve(40, 40, twists, responses)) continue;
    ++solved;
    EXPECT_LE(off_laws_m_s(stack.problem, twists, responses), 1e-8);
  }
  EXPECT_GE(solved, 120);
}

// Factorisations of a hundred stacks that are pushed about.
int factorisations_of_stacks(std::uint32_t cubes) {
  std::mt19937_64 random(2);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53 - 0.5; };
  int factorisations = 0;
  for (int i = 0; i < 100; ++i) {
    Stack stack = stack_of(cubes, 0.4, 0.3);
    for (Twist& twist : stack.problem.free) {
      twist.linear += Vec3(unit(), unit(), unit());
      twist.angular += Vec3(unit(), unit(), unit());
    }
    std::vector<Twist> twists = stack.problem.free;
    Responses responses;
    NewtonLimits limits = limits_of(1.0);
    limits.factorisations = 400;
    const NewtonOutcome outcome =
        solve_by_newton(limits, stack.plan, stack.problem, twists, responses);
    EXPECT_TRUE(outcome.converged);
    factorisations += outcome.factorisations;
  }
  return factorisations;
}

TEST(NewtonSolver, FinishesByTheExactLawsWhatSlides) {
  EXPECT_LE(factorisations_of_stacks(4), 2100);
  EXPECT_LE(factorisations_of_stacks(8), 4700);
}

TEST(AlartCurnier, ChangesNothingWhereItFails) {
  Stack stack = stack_of(3, 0.3, 0.5);
  std::vector<Twist> twists = stack.problem.free;
  const std::vector<Twist> before = twists;
  Responses responses;
  responses.points.resize(stack.problem.points.size());
  const NewtonLimits limits = limits_of(1.0);
  BodyBlocks bodies;
  AlartCurnier exact(limits, stack.plan, stack.problem, bodies, stack.targets);
  EXPECT_FALSE(exact.solve(1, 1, twists, responses));
  for (std::size_t i = 0; i < twists.size(); ++i) {
    EXPECT_EQ(twists[i].linear, before[i].linear);
    EXPECT_EQ(twists[i].angular, before[i].angular);
  }
}

// Where something slides, more does not bring the rest to rest; what stands is solved as before.
TEST(NewtonSolver, WhatMovesIsSolvedToAShareOfItsSpeed) {
  const auto solve = [](Stack stack, double of_motion) {
    NewtonLimits limits = limits_of(1.0);
    limits.accepted_m_s = 0.02;
    limits.factorisations = 400;
    limits.of_motion = of_motion;
    std::vector<Twist> twists = stack.problem.free;
    Responses responses;
    const NewtonOutcome outcome =
        solve_by_newton(limits, stack.plan, stack.problem, twists, responses);
    EXPECT_TRUE(outcome.converged);
    return std::pair(outcome.factorisations, off_laws_m_s(stack.problem, twists, responses));
  };
  std::mt19937_64 random(3);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53 - 0.5; };
  int to_rounding = 0, to_a_share = 0;
  for (int i = 0; i < 40; ++i) {
    Stack stack = stack_of(30, 0.4, 0.1);
    for (Twist& twist : stack.problem.free) twist.linear += Vec3(unit(), unit(), unit());
    to_rounding += solve(stack, 0.0).first;
    const auto [factorisations, off_m_s] = solve(stack, 3e-3);
    to_a_share += factorisations;
    EXPECT_LT(off_m_s, 0.05);
  }
  EXPECT_LT(1.1 * to_a_share, to_rounding);
  Stack rests = stack_of(8, 0.4, 0.0);
  for (Twist& twist : rests.problem.free) twist.linear = Vec3(0, 0, -kStep_m_s);
  EXPECT_EQ(solve(rests, 3e-3), solve(rests, 0.0));
}

}  // namespace
}  // namespace soda::physics
