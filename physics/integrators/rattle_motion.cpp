#include "physics/integrators/rattle_motion.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "physics/constraints/limits_and_motors.hpp"
#include "physics/constraints/springs.hpp"
#include "physics/forces/forces.hpp"
#include "physics/integrators/joint_motion.hpp"
#include "physics/math/solver_body.hpp"
#include "physics/model/island_report.hpp"
#include "physics/solvers/joint_work.hpp"

namespace soda::physics {
namespace {

constexpr int kMostRattleCorrections = 20;

// Joints that are open by at most so many roundings hold. Errors of few roundings are not always
// less after a correction.
constexpr double kHeld = 1e6;

// Limits this many roundings away are reached.
constexpr double kReached = 1e3;

}  // namespace

RattleMotion::RattleMotion(const SceneDescription& scene, std::span<const BodyId> ids,
                           JointSystem& joints)
    : scene_(scene),
      ids_(ids),
      sprung_(has_springs(scene, joints)),
      next_(ids.size()),
      other_(joints),
      at_(&joints),
      end_(&other_),
      kick_changes_(ids.size()) {}

void RattleMotion::start(std::span<const BodyState> states) {
  states_.assign(states.begin(), states.end());
  bodies_ = bodies_at(scene_, ids_, states_);
  build_joint_rows(scene_, scene_.dt_s, states_, false, *at_);
  end_->rows = at_->rows;
  end_->first_row = at_->first_row;
  corrected_s_ = 0.0;
  work = {};
}

// Gravity, drives, forces and damping at states_.
void RattleMotion::push(double time_s) {
  for (std::size_t i = 0; i < ids_.size(); ++i)
    apply_external(scene_, time_s, 0.0, ids_[i], states_[i], bodies_[i]);
}

void RattleMotion::load_velocities() {
  for (std::size_t i = 0; i < ids_.size(); ++i) {
    bodies_[i].linear = states_[i].linear_velocity_m_s;
    bodies_[i].angular = states_[i].angular_velocity_rad_s;
  }
}

bool RattleMotion::goes_against_joints() {
  constexpr double kRounding = 1e-10;
  load_velocities();
  double most = 0.0, largest = 0.0;
  for (const JointRow& row : at_->rows) {
    const SolverBody &a = bodies_[row.a], &b = bodies_[row.b];
    largest = std::max(largest, a.linear.norm() + b.linear.norm() +
                                    row.angular_a.norm() * a.angular.norm() +
                                    row.angular_b.norm() * b.angular.norm());
    if (row.kind == JointRowKind::kHolds)
      most = std::max(most, std::abs(velocity_of(row, bodies_)));
  }
  return most > kRounding * largest;
}

double RattleMotion::swing_rad_s(double time_s) {
  load_velocities();
  push(time_s);
  bound_velocities(time_s, rounding_of(states_, at_->reach_m), *at_);
  stop_joint_velocities(bodies_, *at_);
  std::vector<double> squared(ids_.size(), 0.0);
  const auto stiffen = [&](std::uint32_t body, const JointRow& row, const Vec3& angular) {
    if (body >= ids_.size() || row.linear == Vec3::Zero()) return;
    squared[body] +=
        swing_of(std::abs(row.impulse_newton_s) / time_s, angular.norm(),
                 scene_.bodies[index_of(ids_[body])].mass_kg, bodies_[body].inverse_inertia);
  };
  for (const JointRow& row : at_->rows) {
    stiffen(row.a, row, row.angular_a);
    stiffen(row.b, row, row.angular_b);
  }
  return std::sqrt(*std::ranges::max_element(squared));
}

bool RattleMotion::is_isolated() const { return physics::is_isolated(ids_.size(), *at_, nullptr); }

// After half a kick; before_: the velocities until then, without external forces. A constant push
// over a constant acceleration does exactly its work.
void RattleMotion::add_work(const JointSystem& joints) {
  if (!joints.bounded) return;
  for (const JointRow& row : joints.rows) {
    if (row.kind == JointRowKind::kMotor)
      work.motors_joule +=
          0.5 * row.impulse_newton_s * (velocity_of(row, before_) + velocity_of(row, bodies_));
    work.loses = work.loses || (row.kind == JointRowKind::kLimit && row.impulse_newton_s != 0.0);
  }
}

void RattleMotion::drift(double time_s) { drift_to(scene_, ids_, states_, bodies_, time_s, next_); }

// Gives the bodies what takes the errors of end_ away after time_s: as the joints of at_ tell,
// which is off by as much as the bodies turn in between, and as the corrections so far have shown
// (Broyden's second method).
void RattleMotion::correct(double time_s) {
  const std::size_t rows = at_->rows.size();
  change_.resize(rows);
  error_.resize(rows);
  const auto error_now = [this, time_s](std::size_t r) {
    return at_->rows[r].idle ? 0.0 : end_->rows[r].error / time_s;
  };
  if (shown_count_ > 0) {
    Shown& last = shown_[shown_count_ - 1];
    last.square = 0.0;
    for (std::size_t r = 0; r < rows; ++r) {
      last.error_change[r] = error_now(r) - error_[r];
      last.square += last.error_change[r] * last.error_change[r];
    }
  }
  for (std::size_t r = 0; r < rows; ++r) change_[r] = error_[r] = error_now(r);
  solve_joint_rows(*at_, change_);
  for (std::size_t k = 0; k < shown_count_; ++k) {
    Shown& shown = shown_[k];
    if (k + 1 == shown_count_) shown.missed = change_;
    double share = 0.0;
    for (std::size_t r = 0; r < rows; ++r) share += shown.error_change[r] * error_[r];
    share = shown.square > 0.0 ? share / shown.square : 0.0;
    for (std::size_t r = 0; r < rows; ++r) change_[r] -= share * shown.missed[r];
  }
  for (std::size_t r = 0; r < rows; ++r) corrected_[r] += change_[r] = -change_[r];
  add_joint_impulses(change_, *at_, bodies_);
  if (shown_.size() == shown_count_) shown_.emplace_back();
  shown_[shown_count_++].error_change.resize(rows);
}

// Impulses act at the start of the stage: along its rows, until the joints hold at its end. The
// first guess is what the stage before needed, in proportion to its length.
bool RattleMotion::hold_places(double time_s, double enough, IslandReport& report) {
  shown_count_ = 0;
  corrected_.resize(at_->rows.size());
  const double share = corrected_s_ != 0.0 ? time_s / corrected_s_ : 0.0;
  for (double& impulse : corrected_) impulse = share != 0.0 ? share * impulse : 0.0;
  if (share != 0.0) add_joint_impulses(corrected_, *at_, bodies_);
  drift(time_s);
  build_joint_errors(scene_, next_, *end_);
  if (at_->bounded) {  // before places are corrected no limit holds, and motors are done
    rest_bounds(*at_);
    factor_joint_rows(bodies_, *at_);
    hold_same_limits(*at_, *end_);
  }
  double error = largest_error(*end_);
  for (int i = 0; i < kMostRattleCorrections && error > enough; ++i) {
    const bool more = hold_passed_limits(enough, *end_);
    if (more) {
      work.loses = true;
      hold_same_limits(*end_, *at_);
      factor_joint_rows(bodies_, *at_);
      shown_count_ = 0;
    }
    correct(time_s);
    drift(time_s);
    build_joint_errors(scene_, next_, *end_);
    hold_same_limits(*at_, *end_);
    const double before = std::exchange(error, largest_error(*end_));
    ++report.iterations;
    if (error > 2.0 * before && !more) break;
  }
  corrected_s_ = at_->bounded ? 0.0 : time_s;
  report.constraint_residual_m_s =
      std::max(report.constraint_residual_m_s, error / std::abs(time_s));
  return error <= kHeld * enough;
}

// The second half of a kick, at next_.
void RattleMotion::arrive(double time_s, double enough, IslandReport& report) {
  for (std::size_t i = 0; i < ids_.size(); ++i)
    bodies_[i] = solver_body(scene_.bodies[index_of(ids_[i])], next_[i]);
  if (end_->bounded) before_ = bodies_;
  if (sprung_)
    apply_spring_impulses(spring_rows(scene_, next_, *end_), 0.5 * time_s, true, next_, bodies_,
                          report);
  push(0.5 * time_s);
  build_joint_rows(scene_, time_s, next_, false, *end_);
  bound_velocities(0.5 * time_s, kReached * enough, *end_);
  stop_joint_velocities(bodies_, *end_);
  add_work(*end_);
  report_joints(next_, *end_, report);
  for (std::size_t i = 0; i < ids_.size(); ++i) {
    kick_changes_[i].linear_m_s += bodies_[i].linear - next_[i].linear_velocity_m_s;
    kick_changes_[i].angular_rad_s += bodies_[i].angular - next_[i].angular_velocity_rad_s;
    next_[i].linear_velocity_m_s = bodies_[i].linear;
    next_[i].angular_velocity_rad_s = bodies_[i].angular;
  }
}

bool RattleMotion::advance(double time_s, IslandReport& report) {
  const double enough = rounding_of(states_, at_->reach_m);
  load_velocities();
  if (at_->bounded) before_ = bodies_;
  push(0.5 * time_s);
  if (sprung_)
    apply_spring_impulses(spring_rows(scene_, states_, *at_), 0.5 * time_s, false, states_, bodies_,
                          report);
  for (JointRow& row : at_->rows) row.impulse_newton_s = 0.0;
  rest_bounds(*at_);
  bound_velocities(0.5 * time_s, kReached * enough, *at_);
  const bool factored = at_->factored && !at_->bounded && at_->regularisation == 0.0;
  stop_joint_velocities(bodies_, *at_, factored);
  add_work(*at_);
  if (!hold_places(time_s, enough, report)) return false;
  report_joints(states_, *at_, report);
  for (std::size_t i = 0; i < ids_.size(); ++i)
    kick_changes_[i] = {states_[i].linear_velocity_m_s - bodies_[i].linear,
                        states_[i].angular_velocity_rad_s - bodies_[i].angular};
  arrive(time_s, enough, report);
  std::swap(states_, next_);
  std::swap(at_, end_);
  return true;
}

}  // namespace soda::physics
