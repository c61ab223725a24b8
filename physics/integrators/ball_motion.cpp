#include "physics/integrators/ball_motion.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "physics/constraints/joint_loads.hpp"
#include "physics/forces/forces.hpp"
#include "physics/integrators/joint_motion.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/math/solver_body.hpp"
#include "physics/model/island_report.hpp"

namespace soda::physics {

const Joint* BallMotion::joint_of(const SceneDescription& scene, std::span<const BodyId> ids,
                                  const JointSystem& joints) {
  if (ids.size() != 1 || joints.joints.size() != 1) return nullptr;
  const Joint& joint = scene.joints[joints.joints.front()];
  if (joint.kind != JointKind::kBall || !is_static(joint.b)) return nullptr;
  return is_pushed(scene.bodies[index_of(ids.front())]) ? nullptr : &joint;
}

BallMotion::BallMotion(const SceneDescription& scene, BodyId id, const Joint& joint)
    : scene_(scene),
      body_(scene.bodies[index_of(id)]),
      joint_(joint),
      inverse_mass_(1.0 / body_.mass_kg) {}

void BallMotion::start(std::span<const BodyState> states) {
  state_ = states.front();
  hold_ = hold_at(state_);
  corrected_s_ = 0.0;
  work = {};
}

Vec3 BallMotion::Hold::impulse_for(const Vec3& velocity) const {
  const double x = velocity.x(), y = velocity.y() - lower[0] * x;
  const double z = velocity.z() - lower[1] * x - lower[2] * y;
  const double third = z * inverse_pivots[2];
  const double second = y * inverse_pivots[1] - lower[2] * third;
  return {x * inverse_pivots[0] - lower[0] * second - lower[1] * third, second, third};
}

BallMotion::Hold BallMotion::hold_at(const BodyState& state) const {
  Hold hold;
  hold.arm = state.orientation * joint_.anchor_a_m;
  hold.inverse_inertia = solver_body(body_, state).inverse_inertia;
  // Columns: what a unit impulse does to the velocity of the anchor.
  std::array<Vec3, 3> give;
  for (int i = 0; i < 3; ++i)
    give[i] = times(hold.inverse_inertia, hold.arm.cross(Vec3::Unit(i))).cross(hold.arm);
  const double xx = give[0].x() + inverse_mass_;
  hold.inverse_pivots[0] = 1.0 / xx;
  hold.lower[0] = give[0].y() * hold.inverse_pivots[0];
  hold.lower[1] = give[0].z() * hold.inverse_pivots[0];
  const double yy = give[1].y() + inverse_mass_ - hold.lower[0] * give[0].y();
  const double yz = give[1].z() - hold.lower[0] * give[0].z();
  hold.inverse_pivots[1] = 1.0 / yy;
  hold.lower[2] = yz * hold.inverse_pivots[1];
  const double zz = give[2].z() + inverse_mass_ - hold.lower[1] * give[0].z() - hold.lower[2] * yz;
  hold.inverse_pivots[2] = 1.0 / zz;
  return hold;
}

void BallMotion::push(const Hold& hold, const Vec3& impulse_newton_s, Velocity& velocity) const {
  velocity.linear += impulse_newton_s * inverse_mass_;
  velocity.angular += times(hold.inverse_inertia, hold.arm.cross(impulse_newton_s));
}

// Takes the anchor's velocity away. Returns the impulse.
Vec3 BallMotion::stop(const Hold& hold, Velocity& velocity) const {
  Vec3 impulse = -hold.impulse_for(velocity.linear + velocity.angular.cross(hold.arm));
  push(hold, impulse, velocity);
  return impulse;
}

bool BallMotion::goes_against_joints() {
  constexpr double kRounding = 1e-10;
  const Vec3 &linear = state_.linear_velocity_m_s, &angular = state_.angular_velocity_rad_s;
  return (linear + angular.cross(hold_.arm)).norm() >
         kRounding * (linear.norm() + hold_.arm.norm() * angular.norm());
}

double BallMotion::swing_rad_s(double time_s) {
  Velocity velocity{state_.linear_velocity_m_s + field_of(scene_, body_) * time_s,
                    state_.angular_velocity_rad_s};
  const Vec3 impulse = stop(hold_, velocity);
  double squared = 0.0;
  for (int i = 0; i < 3; ++i)
    squared += swing_of(std::abs(impulse[i]) / time_s, hold_.arm.cross(Vec3::Unit(i)).norm(),
                        body_.mass_kg, hold_.inverse_inertia);
  return std::sqrt(squared);
}

// From state_ on, with this velocity. Returns how far the anchor is off.
Vec3 BallMotion::drift(double time_s, const Velocity& velocity) {
  next_.position_m = state_.position_m + velocity.linear * time_s;
  next_.orientation = state_.orientation;
  next_.linear_velocity_m_s = velocity.linear;
  next_.angular_velocity_rad_s = velocity.angular;
  rotate_freely(body_, time_s, next_);
  return next_.position_m + next_.orientation * joint_.anchor_a_m - joint_.anchor_b_m;
}

// Impulses at the start that move the anchor at the end of the time at some mean speed. A free
// body's angular momentum L stays, and by how much farther it turns for a change of it follows
// I d' = change + L x d: of the solution, the inverse up to the fourth power of the time.
Mat3 BallMotion::correction_matrix(double time_s, const Velocity& velocity) const {
  const Mat3 before =
      rotated_tensor(state_.orientation.toRotationMatrix(), body_.inertia_local_kg_m2);
  const Mat3 rotation = next_.orientation.toRotationMatrix();
  const Mat3 after = rotated_tensor(rotation, body_.inertia_local_kg_m2);
  const Vec3 half = times(before, velocity.angular) * (0.5 * time_s);
  Mat3 bending = 0.5 * (before + after);
  for (int i = 0; i < 3; ++i) {
    const auto again = [&](const Vec3& bent) {
      return Vec3(half.cross(times(hold_.inverse_inertia, bent)));
    };
    const Vec3 once = half.cross(Vec3::Unit(i)), twice = again(once);
    bending.col(i) += twice * (1.0 / 3.0) - once - again(again(twice)) * (1.0 / 45.0);
  }
  const Mat3 turns = bending.inverse();
  const Vec3 arm = times(rotation, joint_.anchor_a_m);
  Mat3 moves;
  for (int i = 0; i < 3; ++i)
    moves.col(i) =
        times(turns, hold_.arm.cross(Vec3::Unit(i))).cross(arm) + Vec3::Unit(i) * inverse_mass_;
  return moves.inverse();
}

bool BallMotion::hold_place(double time_s, double enough, Velocity& velocity, Vec3& impulse,
                            IslandReport& report) {
  corrected_ = corrected_s_ != 0.0 ? Vec3(corrected_ * (time_s / corrected_s_)) : Vec3::Zero();
  corrected_s_ = time_s;
  push(hold_, corrected_, velocity);
  Vec3 error = drift(time_s, velocity), before = error;
  double size = error.cwiseAbs().maxCoeff();
  const Mat3 impulse_per_speed = size > enough ? correction_matrix(time_s, velocity) : Mat3::Zero();
  for (int i = 0; i < kMostCorrections && size > enough; ++i) {
    if (i > 0) shown_[i - 1].error_change = error - before;
    Vec3 missing = times(impulse_per_speed, error / time_s);
    for (int k = 0; k < i; ++k) {
      Shown& shown = shown_[k];
      if (k + 1 == i) shown.missed = missing;
      const double square = shown.error_change.squaredNorm();
      if (square > 0.0) missing -= shown.missed * (shown.error_change.dot(error) / square);
    }
    push(hold_, -missing, velocity);
    corrected_ -= missing;
    before = error;
    error = drift(time_s, velocity);
    const double last = std::exchange(size, error.cwiseAbs().maxCoeff());
    ++report.iterations;
    if (size > 2.0 * last) return false;
  }
  impulse += corrected_;
  report.constraint_residual_m_s =
      std::max(report.constraint_residual_m_s, size / std::abs(time_s));
  return size <= 1e6 * enough;
}

bool BallMotion::advance(double time_s, IslandReport& report) {
  const bool breaks = can_break(joint_);
  const auto give = [&](const Vec3& impulse, const Vec3& position, const Vec3& arm) {
    report.static_impulse_newton_s += impulse;
    if (breaks)
      add_load({static_cast<std::uint32_t>(&joint_ - scene_.joints.data()), -impulse}, report);
    report.static_angular_impulse_newton_m_s += (position + arm).cross(impulse);
  };
  const double enough = rounding_of({&state_, 1}, joint_.anchor_a_m.norm());
  const Vec3 fall = field_of(scene_, body_) * (0.5 * time_s);
  Velocity velocity{state_.linear_velocity_m_s + fall, state_.angular_velocity_rad_s};
  Vec3 impulse = stop(hold_, velocity);
  if (!hold_place(time_s, enough, velocity, impulse, report)) return false;
  give(impulse, state_.position_m, hold_.arm);
  kick_change_ = {state_.linear_velocity_m_s - velocity.linear,
                  state_.angular_velocity_rad_s - velocity.angular};
  velocity = {next_.linear_velocity_m_s + fall, next_.angular_velocity_rad_s};
  hold_ = hold_at(next_);
  give(stop(hold_, velocity), next_.position_m, hold_.arm);
  kick_change_.linear_m_s += velocity.linear - next_.linear_velocity_m_s;
  kick_change_.angular_rad_s += velocity.angular - next_.angular_velocity_rad_s;
  next_.linear_velocity_m_s = velocity.linear;
  next_.angular_velocity_rad_s = velocity.angular;
  std::swap(state_, next_);
  return true;
}

}  // namespace soda::physics
