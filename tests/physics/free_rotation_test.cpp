#include <gtest/gtest.h>

#include <cmath>

#include "physics/math/rigid_motion.hpp"
#include "tests/physics/scenes.hpp"

namespace soda::physics {
namespace {

using test::World;
using LongVec3 = Eigen::Matrix<long double, 3, 1>;
using LongMat3 = Eigen::Matrix<long double, 3, 3>;
using LongQuat = Eigen::Quaternion<long double>;

constexpr double kStep_s = 1.0 / 60.0;

BodyParams solid(const Shape& shape) {
  const MassProperties p = mass_properties(shape);
  BodyParams params;
  params.inertia_local_kg_m2 = p.inertia_per_density_m5;
  params.inverse_inertia_local = params.inertia_local_kg_m2.inverse();
  return params;
}

BodyState spinning(const Vec3& angular_velocity_rad_s) {
  BodyState state;
  state.orientation = test::about(Vec3(1, 2, -3), 0.7);
  state.angular_velocity_rad_s = state.orientation * angular_velocity_rad_s;
  return state;
}

// Euler's equations and q' = q w / 2 by the classical Runge-Kutta method in extended precision.
// Its own error at 4096 steps per second, at 10 rad/s: (10/4096)^4 / 120 * 10 t < 1e-11 t.
struct Reference {
  LongMat3 inertia, inverse;
  LongQuat attitude;
  LongVec3 angular_velocity_local;

  Reference(const BodyParams& params, const BodyState& state)
      : inertia(params.inertia_local_kg_m2.cast<long double>()),
        inverse(inertia.inverse()),
        attitude(state.orientation.cast<long double>()),
        angular_velocity_local(attitude.conjugate() *
                               state.angular_velocity_rad_s.cast<long double>()) {}

  void run(double seconds) {
    const int steps = static_cast<int>(std::lround(seconds * 4096));
    const long double h = static_cast<long double>(seconds) / steps;
    for (int i = 0; i < steps; ++i) step(h);
  }
  double attitude_error_rad(const BodyState& state) const {
    const LongQuat apart = attitude.conjugate() * state.orientation.cast<long double>();
    return static_cast<double>(2 * std::atan2(apart.vec().norm(), std::abs(apart.w())));
  }

 private:
  struct Rates {
    LongVec3 angular_velocity;
    Eigen::Matrix<long double, 4, 1> attitude;
  };
  Rates rates(const LongVec3& angular_velocity, const Eigen::Matrix<long double, 4, 1>& q) const {
    const LongQuat now(q[3], q[0], q[1], q[2]);
    const LongQuat rotation = now * LongQuat(0, angular_velocity[0] / 2, angular_velocity[1] / 2,
                                             angular_velocity[2] / 2);
    return {inverse * LongVec3(LongVec3(inertia * angular_velocity).cross(angular_velocity)),
            rotation.coeffs()};
  }
  void step(long double h) {
    const Eigen::Matrix<long double, 4, 1> q = attitude.coeffs();
    const Rates k1 = rates(angular_velocity_local, q);
    const Rates k2 =
        rates(angular_velocity_local + h / 2 * k1.angular_velocity, q + h / 2 * k1.attitude);
    const Rates k3 =
        rates(angular_velocity_local + h / 2 * k2.angular_velocity, q + h / 2 * k2.attitude);
    const Rates k4 = rates(angular_velocity_local + h * k3.angular_velocity, q + h * k3.attitude);
    angular_velocity_local += h / 6 *
                              (k1.angular_velocity + 2 * k2.angular_velocity +
                               2 * k3.angular_velocity + k4.angular_velocity);
    attitude.coeffs() = q + h / 6 * (k1.attitude + 2 * k2.attitude + 2 * k3.attitude + k4.attitude);
    attitude.normalize();
  }
};

struct Invariants {
  Vec3 momentum;
  double energy_joule;
};

Invariants invariants(const BodyParams& params, const BodyState& state) {
  const Mat3 rotation = state.orientation.toRotationMatrix();
  const Vec3 angular_velocity = rotation.transpose() * state.angular_velocity_rad_s;
  const Vec3 momentum = params.inertia_local_kg_m2 * angular_velocity;
  return {rotation * momentum, 0.5 * momentum.dot(angular_velocity)};
}

void expect_kept(const Invariants& start, const Invariants& now, double bound) {
  EXPECT_LT((now.momentum - start.momentum).norm(), bound * start.momentum.norm());
  EXPECT_NEAR(now.energy_joule, start.energy_joule, bound * start.energy_joule);
}

// Rounding of 1e-15 a step is what is left. Near the middle axis it grows by |w| / |deviation| =
// 500 until the body turns over: 300 steps * 1e-15 * 500.
TEST(FreeRotation, ATumblingBoxFollowsTheExactMotion) {
  const BodyParams params = solid(Box{Vec3(0.5, 0.25, 0.1)});
  BodyState state = spinning(Vec3(0.01, 5, 0.01));
  const Invariants start = invariants(params, state);
  Reference exact(params, state);
  double least = 1.0;
  for (int i = 0; i < 300; ++i) {
    rotate_freely(params, kStep_s, state);
    least = std::min(least, start.momentum.normalized().dot(state.orientation * Vec3::UnitY()));
  }
  exact.run(300 * kStep_s);
  EXPECT_LT(least, -0.9) << "it turns over: the axis of the middle moment is unstable";
  EXPECT_LT(exact.attitude_error_rad(state), 1.5e-10);
  for (int i = 300; i < 1200; ++i) rotate_freely(params, kStep_s, state);
  // A few roundings of 2e-16 a step, always in the same direction where I^-1 is rounded.
  expect_kept(start, invariants(params, state), 1200 * 2e-15);
}

TEST(FreeRotation, ASymmetricBodyPrecessesExactly) {
  // One axis of symmetry each: z, x, y; oblate and prolate.
  const Shape shapes[] = {Cylinder{0.5, 0.2}, Box{Vec3(0.5, 0.2, 0.2)}, Box{Vec3(0.3, 0.1, 0.3)},
                          Capsule{0.1, 0.8}};
  for (const Shape& shape : shapes) {
    SCOPED_TRACE(shape.index());
    const BodyParams params = solid(shape);
    BodyState state = spinning(Vec3(2, -3, 4));
    const Invariants start = invariants(params, state);
    Reference exact(params, state);
    for (int i = 0; i < 600; ++i) rotate_freely(params, kStep_s, state);
    exact.run(600 * kStep_s);
    // The reference's error over 10 s; rounding is smaller, and grows by no more than t.
    EXPECT_LT(exact.attitude_error_rad(state), 1e-10);
    expect_kept(start, invariants(params, state), 600 * 2e-15);
  }
}

// The same box, its own axes named differently: then the inertia has products.
TEST(FreeRotation, DoesNotDependOnTheAxesOfTheBody) {
  const BodyParams params = solid(Box{Vec3(0.5, 0.3, 0.1)});
  const Quat other = test::about(Vec3(3, -1, 2), 1.1);
  const Mat3 axes = other.toRotationMatrix();
  BodyParams renamed = params;
  renamed.inertia_local_kg_m2 = rotated_tensor(axes, params.inertia_local_kg_m2);
  renamed.inverse_inertia_local = rotated_tensor(axes, params.inverse_inertia_local);
  BodyState state = spinning(Vec3(3, 2, -4));
  BodyState same = state;
  same.orientation = Quat(state.orientation * other.conjugate());
  for (int i = 0; i < 600; ++i) {
    rotate_freely(params, kStep_s, state);
    rotate_freely(renamed, kStep_s, same);
  }
  // 600 steps of 1e-15, of two bodies, growing linearly with time.
  EXPECT_LT((same.angular_velocity_rad_s - state.angular_velocity_rad_s).norm(), 5e-11);
}

TEST(FreeRotation, OneLongStepIsManyShortOnes) {
  const Shape shapes[] = {Box{Vec3(0.5, 0.3, 0.1)}, Cylinder{0.5, 0.2}, Sphere{0.3}};
  for (const Shape& shape : shapes) {
    SCOPED_TRACE(shape.index());
    const BodyParams params = solid(shape);
    BodyState once = spinning(Vec3(3, 2, -4));
    BodyState often = once;
    rotate_freely(params, 10.0, once);
    for (int i = 0; i < 2560; ++i) rotate_freely(params, 10.0 / 2560, often);
    EXPECT_LT((once.orientation.toRotationMatrix() - often.orientation.toRotationMatrix()).norm(),
              5e-11);
    EXPECT_LT((once.angular_velocity_rad_s - often.angular_velocity_rad_s).norm(), 5e-11);
  }
}

TEST(FreeRotation, NeedlesAndPlatesKeepMomentumAndEnergy) {
  // Moments 1 : 1e6. What rounding does to the angular velocity about the thin axis counts that
  // much more.
  for (const Vec3& half : {Vec3(1e-3, 2e-3, 1.0), Vec3(1.0, 0.9, 1e-3)}) {
    const BodyParams params = solid(Box{half});
    BodyState state = spinning(Vec3(1, 2, 3));
    const Invariants start = invariants(params, state);
    for (int i = 0; i < 600; ++i) rotate_freely(params, kStep_s, state);
    expect_kept(start, invariants(params, state), 1e-9);
  }
}

TEST(FreeRotation, ATurnBetweenDirectionsLeadsFromOneToTheOtherOppositeOnesToo) {
  const Vec3 directions[] = {Vec3::UnitX(),        -Vec3::UnitX(),       Vec3::UnitZ(),
                             -2.0 * Vec3::UnitZ(), Vec3(1.0, 2.0, -3.0), Vec3(-1.0, -2.0, 3.0),
                             Vec3(1e-7, 0.0, -1.0)};
  for (const Vec3& from : directions)
    for (const Vec3& to : directions) {
      const Quat turn = turn_between(from, to);
      EXPECT_NEAR(turn.norm(), 1.0, 1e-12) << from.transpose() << " to " << to.transpose();
      EXPECT_LT((turn * from.normalized() - to.normalized()).norm(), 1e-12)
          << from.transpose() << " to " << to.transpose();
      EXPECT_LT(std::abs(turn.vec().dot(from)) + std::abs(turn.vec().dot(to)), 1e-12);
      if (from == to) {
        EXPECT_NEAR(turn.w(), 1.0, 1e-15);
      }
    }
}

TEST(FreeRotation, AnAbsurdAngularVelocityEndsAndGainsNothing) {
  for (const double angular_speed : {1e4, 1e6, 1e9}) {
    SCOPED_TRACE(angular_speed);
    const BodyParams params = solid(Box{Vec3(0.5, 0.25, 0.1)});
    BodyState state = spinning(angular_speed * Vec3(0.1, 0.7, -0.7));
    const Invariants start = invariants(params, state);
    for (int i = 0; i < 10; ++i) rotate_freely(params, kStep_s, state);
    // 1024 stretches a step, 1e-15 each.
    expect_kept(start, invariants(params, state), 1e-11);
    EXPECT_NEAR(state.orientation.norm(), 1.0, 1e-15);
  }
}

}  // namespace
}  // namespace soda::physics
