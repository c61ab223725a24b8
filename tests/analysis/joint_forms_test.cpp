// Closed forms of forces, springs and joints against the laws that they solve.
#include "analysis/accuracy/joint_forms.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "analysis/accuracy/joint_judges.hpp"

namespace soda::analysis {
namespace {

using physics::Joint;
using physics::JointKind;
using physics::Quat;
using physics::Vec3;

const Vec3 kDown(0, 0, -9.81);

StartingBody solid(const Vec3& moments, const Vec3& position) {
  StartingBody body;
  body.params.mass_kg = 2.0;
  body.params.inertia_local_kg_m2 = moments.asDiagonal();
  body.state.position_m = position;
  return body;
}

// Central differences: position, velocity and what accelerates it belong together.
template <class Law>
void expect_law(const MotionAt& motion, const Law& acceleration, double h, double slack) {
  for (double t = 0.05; t < 2.0; t += 0.0937) {
    const Motion before = motion(t - h), now = motion(t), after = motion(t + h);
    const Vec3 v = (after.position_m - before.position_m) / (2 * h);
    const Vec3 a = (after.linear_velocity_m_s - before.linear_velocity_m_s) / (2 * h);
    EXPECT_LT((v - now.linear_velocity_m_s).norm(), slack) << t;
    EXPECT_LT((a - acceleration(now)).norm(), slack) << t;
  }
}

TEST(JointForms, FlightUnderForcesObeysNewton) {
  StartingBody body = solid(Vec3(1, 2, 3), Vec3(1, 2, 3));
  body.state.linear_velocity_m_s = Vec3(4, 0, 7);
  body.state.angular_velocity_rad_s = Vec3(0, 0, 2);
  physics::BodyForces forces{.linear_damping_1_s = 0.7};
  body.params.own_field_m_s2 = Vec3(1, 2, -3);
  forces.torque_newton_m = Vec3(0, 0, 6);
  forces.angular_damping_1_s = 0.4;
  const MotionAt motion = forced_flight(body, forces, kDown);
  expect_law(
      motion,
      [&](const Motion& m) {
        return Vec3(kDown + body.params.own_field_m_s2 - m.linear_velocity_m_s * 0.7);
      },
      1e-4, 1e-6);
  const double h = 1e-4;
  const Vec3 alpha =
      (*motion(1 + h).angular_velocity_rad_s - *motion(1 - h).angular_velocity_rad_s) / (2 * h);
  EXPECT_NEAR(alpha.z(), 6.0 / 3.0 - 0.4 * motion(1).angular_velocity_rad_s->z(), 1e-7);
  const Quat turn = *motion(1 + h).orientation * motion(1 - h).orientation->conjugate();
  EXPECT_NEAR(2.0 * turn.z() / (2 * h), motion(1).angular_velocity_rad_s->z(), 1e-6);
  body.state.angular_velocity_rad_s = Vec3(1, 0, 2);
  EXPECT_FALSE(forced_flight(body, forces, kDown)(1).orientation) << "no axis to stay about";
}

TEST(JointForms, OscillatorsObeyTheirEquationWhateverTheirDamping) {
  const StartingBody body = solid(Vec3(1, 1, 1), Vec3(0, 0, -0.6));
  Joint spring;
  spring.kind = JointKind::kSpring;
  spring.length_m = 0.5;
  spring.stiffness_newton_m = 50.0;
  for (const double damping : {0.0, 3.0, 20.0, 60.0}) {
    spring.damping_newton_s_m = damping;
    const MotionAt motion = damped_oscillator(body, spring, kDown, 0.0);
    EXPECT_LT((motion(0).position_m - body.state.position_m).norm(), 1e-15);
    EXPECT_LT(motion(0).linear_velocity_m_s.norm(), 1e-14);
    expect_law(
        motion,
        [&](const Motion& m) {
          const double pull = 50.0 * (-m.position_m.z() - 0.5);
          return Vec3(0, 0, -9.81 + (pull - damping * m.linear_velocity_m_s.z()) / 2.0);
        },
        1e-4, 1e-5);
  }
}

TEST(JointForms, FrictionTakesAsMuchOfEachSwingAndEndsThemWhereItHoldsTheSpring) {
  const StartingBody body = solid(Vec3(1, 1, 1), Vec3(1.3, 0, 0));
  Joint spring;
  spring.kind = JointKind::kSpring;
  spring.length_m = 0.5;
  spring.stiffness_newton_m = 50.0;
  const double friction = 0.2, reach = friction * 2.0 * 9.81 / 50.0, half = std::numbers::pi / 5.0;
  const MotionAt motion = damped_oscillator(body, spring, kDown, friction);
  const auto place = [&](double t) { return motion(t).position_m.x() - 0.5; };
  EXPECT_NEAR(place(half), -(0.8 - 2 * reach), 1e-14);
  EXPECT_NEAR(place(2 * half), 0.8 - 4 * reach, 1e-14);
  EXPECT_NEAR(place(10 * half), place(20 * half), 0.0);
  EXPECT_LT(std::abs(place(20 * half)), reach);
  spring.damping_newton_s_m = 3.0;
  const MotionAt damped = damped_oscillator(body, spring, kDown, friction);
  const double h = 1e-5;
  for (const double t : {0.1, 0.5, 0.8, 1.2, 1.5}) {
    const double v = damped(t).linear_velocity_m_s.x();
    ASSERT_NE(v, 0.0);
    const double a =
        (damped(t + h).linear_velocity_m_s.x() - damped(t - h).linear_velocity_m_s.x()) / (2 * h);
    const double law = (-50.0 * (damped(t).position_m.x() - 0.5) - 3.0 * v) / 2.0 -
                       std::copysign(friction * 9.81, v);
    EXPECT_NEAR(a, law, 1e-6) << t;
  }
}

// The rate of the angular momentum about the fixed point is the torque of the weight.
TEST(JointForms, ATopPrecessesAsItsWeightAsks) {
  const double spin = 60.0, tilt = 0.5, arm = 0.3, own = 0.05, cross = 0.03 + 2.0 * arm * arm;
  const double a = cross * std::cos(tilt), b = own * spin, c = 2.0 * 9.81 * arm;
  const double rate = (b - std::sqrt(b * b - 4 * a * c)) / (2 * a);
  StartingBody top =
      solid(Vec3(0.03, 0.03, own), Vec3(arm * std::sin(tilt), 0, arm * std::cos(tilt)));
  top.state.orientation = Quat(Eigen::AngleAxisd(tilt, Vec3::UnitY()));
  const Vec3 axis = top.state.orientation * Vec3(Vec3::UnitZ());
  top.state.angular_velocity_rad_s = Vec3(0, 0, rate) + axis * (spin - rate * std::cos(tilt));
  const MotionAt motion = steady_precession(top, Joint{}, kDown, rate);
  const auto momentum = [&](double t) {
    const Motion m = motion(t);
    const Vec3 local = m.orientation->conjugate() * *m.angular_velocity_rad_s;
    return Vec3(m.position_m.cross(m.linear_velocity_m_s) * 2.0 +
                *m.orientation * Vec3(top.params.inertia_local_kg_m2 * local));
  };
  const double h = 1e-4;
  for (const double t : {0.1, 0.7, 1.9}) {
    const Vec3 torque = motion(t).position_m.cross(Vec3(kDown * 2.0));
    EXPECT_LT((Vec3(momentum(t + h) - momentum(t - h)) / (2 * h) - torque).norm(), 1e-6);
    const Vec3 moved = (motion(t + h).position_m - motion(t - h).position_m) / (2 * h);
    EXPECT_LT((moved - motion(t).linear_velocity_m_s).norm(), 1e-6);
    const Quat turn = *motion(t + h).orientation * motion(t - h).orientation->conjugate();
    EXPECT_LT((Vec3(turn.vec()) / h - *motion(t).angular_velocity_rad_s).norm(), 1e-3);
  }
}

TEST(JointForms, ALiftRunsUpKeepsItsSpeedAndStops) {
  const StartingBody body = solid(Vec3(1, 1, 1), Vec3(0, 0, 0));
  Joint slider;
  slider.kind = JointKind::kSlider;
  slider.motor = physics::JointMotor{-1.5, 2.0 * (9.81 + 3.0)};
  slider.limits = physics::JointLimits{-2.0, 0.1};
  const MotionAt motion = joint_travel(body, slider, kDown);
  EXPECT_NEAR(motion(0.25).linear_velocity_m_s.z(), 0.75, 1e-14);
  EXPECT_NEAR(motion(0.5).position_m.z(), 0.375, 1e-14);
  EXPECT_NEAR(motion(1.0).position_m.z(), 0.375 + 0.75, 1e-14);
  EXPECT_NEAR(motion(5.0).position_m.z(), 2.0, 1e-14);
  EXPECT_EQ(motion(5.0).linear_velocity_m_s.z(), 0.0);
}

TEST(JointForms, ABodyThrownAgainstAStopFallsBackToTheOther) {
  StartingBody body = solid(Vec3(1, 1, 1), Vec3(0, 0, 0));
  body.state.linear_velocity_m_s.z() = 3.0;
  Joint slider;
  slider.kind = JointKind::kSlider;
  slider.limits = physics::JointLimits{-0.2, 1.0};
  const MotionAt motion = joint_travel(body, slider, kDown);
  const double up = (3.0 - std::sqrt(9.0 - 2 * 9.81 * 0.2)) / 9.81;
  EXPECT_NEAR(motion(up + 0.1).position_m.z(), 0.2 - 0.5 * 9.81 * 0.01, 1e-13);
  EXPECT_NEAR(motion(3.0).position_m.z(), -1.0, 1e-14);
}

TEST(JointJudges, FindAGapOfKnownSizeOffASlidersAxisOnly) {
  Joint joint;
  joint.kind = JointKind::kSlider;
  std::vector<physics::BodyState> states(1);
  states[0].position_m = Vec3(0.03, 0.04, 7.0);
  EXPECT_NEAR(joint_gap_m(joint, states), 0.05, 1e-15);
  joint.kind = JointKind::kBall;
  EXPECT_NEAR(joint_gap_m(joint, states), states[0].position_m.norm(), 1e-15);
  joint.kind = JointKind::kDistance;
  joint.length_m = 7.0;
  EXPECT_NEAR(joint_gap_m(joint, states), states[0].position_m.norm() - 7.0, 1e-15);
}

}  // namespace
}  // namespace soda::analysis
