// Closed forms against independent integration or the laws that they come from.
#include "analysis/accuracy/closed_forms.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "analysis/accuracy/motion_judges.hpp"
#include "analysis/accuracy/torque_free.hpp"

namespace soda::analysis {
namespace {

using physics::Quat;
using physics::Vec3;

StartingBody solid(const Vec3& moments, const Vec3& spin) {
  StartingBody body;
  body.params.mass_kg = 2.0;
  body.params.inertia_local_kg_m2 = moments.asDiagonal();
  body.state.angular_velocity_rad_s = spin;
  return body;
}

StartingBody sphere(double radius, double mass, const Vec3& position, const Vec3& velocity) {
  StartingBody body = solid(Vec3::Constant(0.4 * mass * radius * radius), Vec3::Zero());
  body.params.mass_kg = mass;
  body.radius_m = radius;
  body.state.position_m = position;
  body.state.linear_velocity_m_s = velocity;
  return body;
}

// World angular momentum is constant: only the attitude is integrated, by the classic Runge-Kutta
// scheme. Nothing is shared with the closed form.
Quat integrated_attitude(const StartingBody& body, double time_s, int steps) {
  const auto rate = [&](const Quat& q, const Vec3& momentum) {
    const Vec3 local = q.conjugate() * momentum;
    const Vec3 spin = q * Vec3(local.cwiseQuotient(body.params.inertia_local_kg_m2.diagonal()));
    return Quat(0, 0.5 * spin.x(), 0.5 * spin.y(), 0.5 * spin.z()) * q;
  };
  const auto along = [](const Quat& q, const Quat& slope, double h) {
    return Quat(q.coeffs() + h * slope.coeffs());
  };
  Quat q = body.state.orientation;
  const Vec3 momentum = q * Vec3(body.params.inertia_local_kg_m2 *
                                 Vec3(q.conjugate() * body.state.angular_velocity_rad_s));
  const double h = time_s / steps;
  for (int i = 0; i < steps; ++i) {
    const Quat a = rate(q, momentum), b = rate(along(q, a, h / 2).normalized(), momentum);
    const Quat c = rate(along(q, b, h / 2).normalized(), momentum);
    const Quat d = rate(along(q, c, h).normalized(), momentum);
    q = Quat(q.coeffs() + h / 6 * (a.coeffs() + 2 * b.coeffs() + 2 * c.coeffs() + d.coeffs()))
            .normalized();
  }
  return q;
}

// In steps of 1/4000 s the two agree to 3e-12 but for the needle, where the difference is the
// integration's own: 5.4e-4, 2.1e-6, 1.4e-7 rad at 1/1000, 1/4000, 1/8000 s, its fourth order.
TEST(TorqueFree, AgreesWithIntegrationForEveryKindOfBody) {
  struct Case {
    const char* what;
    Vec3 moments, spin;
    double tolerance_rad = 1e-11;
  };
  const Case cases[] = {
      {"tumbles about the middle axis", {1.0, 3.0, 4.0}, {0.01, 0.01, 3.0}},
      {"tumbles, axes in another order", {0.5, 1.0, 0.7}, {0.02, -0.03, 2.5}},
      {"goes round the largest moment", {1.0, 2.0, 3.0}, {0.3, 0.4, -2.0}},
      {"goes round the smallest moment", {1.0, 2.0, 3.0}, {-2.5, 0.4, 0.3}},
      {"oblate", {1.0, 1.0, 1.8}, {0.7, -0.2, 2.0}},
      {"prolate", {0.2, 1.0, 1.0}, {3.0, 0.5, 0.6}},
      {"needle", {1e-4, 1.0, 1.0}, {3.0, 0.5, 0.6}, 3e-6},
      {"isotropic", {1.0, 1.0, 1.0}, {0.7, -0.2, 2.0}},
      {"about a principal axis", {1.0, 2.0, 3.0}, {0.0, 2.0, 0.0}},
  };
  for (const Case& c : cases) {
    StartingBody body = solid(c.moments, c.spin);
    body.state.orientation = Quat(0.5, 0.5, -0.5, 0.5);
    const MotionAt exact = torque_free(body);
    for (const double t : {0.0, 2.5, 5.0, 10.0}) {
      const Motion motion = exact(t);
      const Quat expected = integrated_attitude(body, t, static_cast<int>(4000 * t));
      EXPECT_LT(angle_between(*motion.orientation, expected), c.tolerance_rad)
          << c.what << " at " << t;
    }
  }
}

TEST(TorqueFree, KeepsEnergyAndAngularMomentum) {
  const StartingBody body = solid(Vec3(1.0, 3.0, 4.0), Vec3(0.01, 3.0, 0.01));
  const MotionAt exact = torque_free(body);
  const Vec3 momentum = body.params.inertia_local_kg_m2 * body.state.angular_velocity_rad_s;
  const double energy = momentum.dot(body.state.angular_velocity_rad_s);
  double most_turned = 1.0;
  for (int i = 0; i <= 400; ++i) {
    const Motion motion = exact(0.1 * i);
    const Vec3 local = motion.orientation->conjugate() * *motion.angular_velocity_rad_s;
    const Vec3 now = *motion.orientation * Vec3(body.params.inertia_local_kg_m2 * local);
    EXPECT_LT((now - momentum).norm(), 1e-12 * momentum.norm()) << i;
    EXPECT_NEAR(now.dot(*motion.angular_velocity_rad_s), energy, 1e-12 * energy) << i;
    most_turned = std::min(most_turned, (*motion.orientation * Vec3::UnitY()).y());
  }
  EXPECT_LT(most_turned, -0.9) << "it tumbles";
}

TEST(Rolling, FollowsCoulombsLawIntegratedInSmallSteps) {
  for (const double friction : {0.05, 0.3})
    for (const double slope_deg : {0.0, 25.0})
      for (const double spin : {0.0, 30.0, -30.0}) {
        StartingBody body = sphere(0.5, 1.0, Vec3::Zero(), Vec3::Zero());
        const scenarios::Rolling answer{1, slope_deg, 40.0, friction};
        const Slope slope = slope_of(slope_deg, 40.0);
        const Vec3 axis = slope.normal.cross(slope.down);
        body.state.linear_velocity_m_s = slope.down * 2.0;
        body.state.angular_velocity_rad_s = axis * spin;
        const Motion exact = rolling(body, 9.81, answer)(1.5);

        const double t = slope_deg * std::numbers::pi / 180.0, h = 1e-5;
        const double pull = 9.81 * std::sin(t), most = friction * 9.81 * std::cos(t);
        double way = 0.0, v = 2.0, w = spin;
        for (int i = 0; i < 150'000; ++i) {
          // What friction would have to be for the slip to vanish within the step, if it is enough.
          const double wanted = (v - 0.5 * w + h * pull) / (3.5 * h);
          const double force = std::clamp(wanted, -most, most);
          v += h * (pull - force);
          w += h * 5.0 * force;
          way += h * v;
        }
        EXPECT_NEAR(exact.position_m.dot(slope.down), way, 1e-4) << friction << " " << slope_deg;
        EXPECT_NEAR(exact.linear_velocity_m_s.dot(slope.down), v, 1e-4) << spin;
        EXPECT_NEAR(exact.angular_velocity_rad_s->dot(axis), w, 5e-4) << spin;
      }
}

TEST(Sliding, StopsWhereItsEnergyIsUsedUp) {
  const SlidingLaw law = sliding_law(3.0, 9.81, 5.0, 0.4);
  const double t = 5.0 * std::numbers::pi / 180.0;
  ASSERT_TRUE(law.stops);
  // Kinetic energy and the height lost go into friction.
  EXPECT_NEAR(0.5 * 9.0 + 9.81 * std::sin(t) * law.stop_way_m,
              0.4 * 9.81 * std::cos(t) * law.stop_way_m, 1e-12);
  EXPECT_FALSE(sliding_law(0.0, 9.81, 30.0, 0.2).stops);
}

// Friction takes twice its work on the way up and down again.
TEST(Sliding, WhatIsThrownUpASlopeComesBackSlowerByWhatFrictionTakes) {
  const double t = 20.0 * std::numbers::pi / 180.0, friction = 0.2;
  const SlidingLaw law = sliding_law(-3.0, 9.81, 20.0, friction);
  ASSERT_TRUE(law.turns && !law.stops);
  const double back_s = law.stop_time_s + std::sqrt(-2.0 * law.stop_way_m / law.after_m_s2);
  const StartingBody body = sphere(0.1, 1.0, Vec3::Zero(), Vec3::Zero());
  const Slope slope = slope_of(20.0, 0.0);
  const Motion back = sliding(body, slope, law)(back_s);
  EXPECT_NEAR(back.position_m.norm(), 0.0, 1e-14);
  EXPECT_NEAR(0.5 * back.linear_velocity_m_s.squaredNorm(),
              4.5 + 2.0 * friction * 9.81 * std::cos(t) * law.stop_way_m, 1e-12);
  EXPECT_GT(back.linear_velocity_m_s.dot(slope.down), 0.0);
  EXPECT_TRUE(sliding_law(-3.0, 9.81, 5.0, friction).stops);
}

TEST(Bouncing, LosesTheRightEnergyAndRests) {
  const StartingBody body = sphere(0.1, 1.0, Vec3(0, 0, 1.1), Vec3::Zero());
  const BouncingLaw law = bouncing_law(body, 9.81, 0.8);
  const MotionAt exact = bouncing(body, law);
  double last = 9.81;  // energy over mass, from the floor
  int drops = 0;
  for (int i = 1; i <= 300; ++i) {
    const Motion motion = exact(0.01 * i);
    const double energy =
        9.81 * (motion.position_m.z() - 0.1) + 0.5 * motion.linear_velocity_m_s.squaredNorm();
    EXPECT_GE(motion.position_m.z(), 0.1 - 1e-12);
    if (energy < last - 1e-9) {
      EXPECT_NEAR(energy / last, 0.64, 1e-9) << i;
      ++drops;
    }
    last = energy;
  }
  EXPECT_EQ(drops, 6);
  EXPECT_NEAR(law.rest_time_s(), std::sqrt(2 / 9.81) * 1.8 / 0.2, 1e-12);
  EXPECT_EQ(exact(law.rest_time_s() + 0.1).position_m.z(), 0.1);
}

TEST(TwoSpheres, KeepMomentumAndLoseTheRightEnergyAlongTheNormal) {
  const StartingBody a = sphere(0.5, 2.0, Vec3(-5, 0, 0), Vec3(7, 0, 1));
  const StartingBody b = sphere(0.3, 1.0, Vec3(5, 0.5, 0.1), Vec3(-6, 0, 1));
  const std::vector<MotionAt> motions = two_spheres(a, b, Vec3(0, 0, -9.81), 0.6);
  const Motion a1 = motions[0](2.0), b1 = motions[1](2.0);
  const Vec3 gravity(0, 0, -2 * 9.81);
  const Vec3 before = 2.0 * Vec3(7, 0, 1) + Vec3(-6, 0, 1) + 3.0 * gravity;
  EXPECT_LT((2.0 * a1.linear_velocity_m_s + b1.linear_velocity_m_s - before).norm(), 1e-12);
  // They touch when the impulse acts, and it acts along the line of centres.
  const Vec3 impulse = b1.linear_velocity_m_s - gravity - Vec3(-6, 0, 1);
  double least = 1e9;
  for (int i = 0; i < 200'000; ++i) {
    const double t = 1e-5 * i;
    least = std::min(least, (motions[1](t).position_m - motions[0](t).position_m).norm());
  }
  EXPECT_NEAR(least, 0.8, 2e-4);
  EXPECT_NEAR((b1.linear_velocity_m_s - a1.linear_velocity_m_s).dot(impulse.normalized()),
              0.6 * 13.0 * std::abs(impulse.normalized().x()), 1e-9);
}

TEST(SphereLine, PassesVelocitiesOnAndKeepsTheOrder) {
  std::vector<StartingBody> bodies;
  bodies.push_back(sphere(0.1, 1.0, Vec3(-1, 0, 0), Vec3(2, 0, 0)));
  bodies.push_back(sphere(0.1, 1.0, Vec3(0, 0, 0), Vec3(0, 0, 0)));
  bodies.push_back(sphere(0.1, 1.0, Vec3(0.2, 0, 0), Vec3(0, 0, 0)));  // touches the second
  const std::vector<MotionAt> motions = sphere_line(bodies);
  // Contact after 0.8 m: 0.4 s. Then the third leaves and the others stay.
  EXPECT_NEAR(motions[0](1.0).position_m.x(), -0.2, 1e-12);
  EXPECT_NEAR(motions[1](1.0).position_m.x(), 0.0, 1e-12);
  EXPECT_NEAR(motions[2](1.0).position_m.x(), 0.2 + 2.0 * 0.6, 1e-12);
  EXPECT_EQ(motions[2](1.0).linear_velocity_m_s.x(), 2.0);
  EXPECT_EQ(motions[0](1.0).linear_velocity_m_s.x(), 0.0);
}

TEST(FloorImpact, SticksOrSlipsAsCoulombSays) {
  for (const double friction : {0.02, 0.8}) {
    StartingBody body = sphere(0.2, 3.0, Vec3(0, 0, 1.2), Vec3(2, -1, -4));
    body.state.angular_velocity_rad_s = Vec3(5, 7, 3);
    const Motion after = floor_impact(body, {1, friction, 0.7})(1.0);
    const Vec3 arm(0, 0, -0.2), v = after.linear_velocity_m_s, w = *after.angular_velocity_rad_s;
    Vec3 slip = v + w.cross(arm);
    slip.z() = 0.0;
    const Vec3 impulse = 3.0 * (v - Vec3(2, -1, -4));
    const double tangential = std::hypot(impulse.x(), impulse.y());
    EXPECT_NEAR(v.z(), 2.8, 1e-12);
    if (friction == 0.8) {
      EXPECT_LT(slip.norm(), 1e-12);
      EXPECT_LT(tangential, friction * impulse.z());
    } else {
      EXPECT_GT(slip.norm(), 0.1);
      EXPECT_NEAR(tangential, friction * impulse.z(), 1e-12);
    }
    // Angular momentum about the contact point cannot change there.
    const double inertia = 0.4 * 3.0 * 0.04;
    const Vec3 about = inertia * w - 3.0 * arm.cross(v);
    const Vec3 before = inertia * Vec3(5, 7, 3) - 3.0 * arm.cross(Vec3(2, -1, -4));
    EXPECT_LT((about - before).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace soda::analysis
