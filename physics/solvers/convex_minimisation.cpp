#include "physics/solvers/convex_minimisation.hpp"

#include <algorithm>
#include <cmath>

#include "physics/math/rigid_motion.hpp"

namespace soda::physics {
namespace {

constexpr double kHarder = 10.0;

}  // namespace

ConvexMinimisation::ConvexMinimisation(const NewtonLimits& limits, const Elimination& plan,
                                       ConvexContacts& problem, std::vector<Twist>& twists,
                                       Responses& responses)
    : limits_(limits),
      plan_(plan),
      problem_(problem),
      twists_(twists),
      all_(responses),
      responses_(responses.points),
      velocity_(problem.points.size()),
      change_(problem.points.size()),
      turning_(problem.turnings.size()),
      turning_change_(problem.turnings.size()),
      row_velocity_(problem.rows.size()),
      row_change_(problem.rows.size()),
      factor_modes_(problem.points.size()),
      factor_turnings_(problem.turnings.size()),
      factor_held_(problem.rows.size()) {
  row_rounding_m_s_ = rounding_of_rows_m_s();
}

void ConvexMinimisation::harden_points() {
  problem_.compliance_1_kg /= kHarder;
  softness_ /= kHarder;
  factored_ = false;
}

void ConvexMinimisation::harden_rows() {
  for (ConvexRow& row : problem_.rows)
    if (!row.soft) row.stiffness_kg *= kHarder;
  row_stiffness_ *= kHarder;
  bodies_.blocks.clear();
  factored_ = false;
}

void ConvexMinimisation::update() {
  const double stiffness_kg = 1.0 / problem_.compliance_1_kg;
  for (std::size_t i = 0; i < responses_.size(); ++i) {
    velocity_[i] = relative_velocity(problem_.points[i], twists_);
    responses_[i] = respond(problem_.points[i], stiffness_kg, velocity_[i]);
  }
  for (std::size_t i = 0; i < turning_.size(); ++i) {
    turning_[i] = relative_velocity(problem_.turnings[i], twists_);
    all_.turnings[i] = respond(problem_.turnings[i], stiffness_kg, turning_[i]);
  }
  for (std::size_t i = 0; i < row_velocity_.size(); ++i) {
    row_velocity_[i] = relative_velocity(problem_.rows[i], twists_);
    all_.rows[i] = respond(problem_.rows[i], row_velocity_[i]);
  }
  gradient(problem_, twists_, all_, gradient_);
}

double ConvexMinimisation::gradient_m_s() const { return largest_m_s(problem_, gradient_); }

// A row's impulse is its stiffness times a difference of the bodies' velocities.
double ConvexMinimisation::rounding_of_rows_m_s() const {
  constexpr double kOfSpeed = 1e-15;
  double squared = 0.0, stiffest = 0.0;
  for (std::size_t i = 0; i < problem_.bodies.size(); ++i) {
    const ConvexBody& body = problem_.bodies[i];
    const Twist& free = problem_.free[i];
    const double rotational = free.angular.dot(times(body.inertia_kg_m2, free.angular));
    squared = std::max(squared, free.linear.squaredNorm() + rotational / body.mass_kg);
  }
  for (const ConvexRow& row : problem_.rows) {
    if (row.soft) continue;
    double mass_kg = problem_.bodies[row.a].mass_kg;
    if (row.b < problem_.bodies.size()) mass_kg = std::min(mass_kg, problem_.bodies[row.b].mass_kg);
    stiffest = std::max(stiffest, row.stiffness_kg / (mass_kg * row.speed * row.speed));
  }
  return kOfSpeed * std::sqrt(squared) * stiffest;
}

double ConvexMinimisation::rounding_m_s() const {
  constexpr double kOfScale = 1e-15;
  return std::max(kOfScale * limits_.scale_m_s / softness_, row_rounding_m_s_ * row_stiffness_);
}

double ConvexMinimisation::objective() const {
  double sum = 0.0;
  for (std::size_t i = 0; i < twists_.size(); ++i) {
    const ConvexBody& body = problem_.bodies[i];
    const Vec3 linear = twists_[i].linear - problem_.free[i].linear;
    const Vec3 angular = twists_[i].angular - problem_.free[i].angular;
    sum += body.mass_kg * linear.squaredNorm() + angular.dot(times(body.inertia_kg_m2, angular));
  }
  for (const PointResponse& response : responses_) {
    sum += problem_.compliance_1_kg * response.impulse_newton_s.squaredNorm();
  }
  for (const TurningResponse& response : all_.turnings) {
    const Vec3& impulse = response.impulse_newton_s;
    sum += problem_.compliance_1_kg * impulse.dot(2.0 * response.wanted_newton_s - impulse);
  }
  for (std::size_t i = 0; i < row_velocity_.size(); ++i) {
    const RowResponse& response = all_.rows[i];
    sum += response.impulse_newton_s *
           (2.0 * response.wanted_newton_s - response.impulse_newton_s) /
           problem_.rows[i].stiffness_kg;
  }
  return 0.5 * sum;
}

// Whether every point answers as when the factor was made. What slides answers differently each
// time, unless it is without friction.
bool ConvexMinimisation::fits_factor() const {
  bool same = factored_;
  for (std::size_t i = 0; same && i < responses_.size(); ++i) {
    const ContactMode mode = responses_[i].mode;
    same = mode == factor_modes_[i] &&
           (mode != ContactMode::kSlide || problem_.points[i].friction == 0.0);
  }
  for (std::size_t i = 0; same && i < factor_turnings_.size(); ++i)
    same = all_.turnings[i].is_bounded_as(factor_turnings_[i]) && !all_.turnings[i].turns_along() &&
           !factor_turnings_[i].turns_along();
  for (std::size_t i = 0; same && i < factor_held_.size(); ++i)
    same = factor_held_[i] == all_.rows[i].held;
  return same;
}

bool ConvexMinimisation::refactor(bool accepted) {
  if (fits_factor()) return true;
  if (factorisations_ >= limits_.factorisations) return false;
  if (accepted && further_++ >= limits_.further) return false;
  ++factorisations_;
  assemble(problem_, plan_, all_, bodies_, factor_);
  factored_ = factorise(plan_, factor_);
  for (std::size_t i = 0; i < responses_.size(); ++i) factor_modes_[i] = responses_[i].mode;
  factor_turnings_ = all_.turnings;
  for (std::size_t i = 0; i < factor_held_.size(); ++i) factor_held_[i] = all_.rows[i].held;
  return factored_;
}

void ConvexMinimisation::find_direction() {
  values_.resize(twists_.size());
  direction_.resize(twists_.size());
  for (std::size_t i = 0; i < twists_.size(); ++i) {
    BlockVector& value = values_[plan_.place_of[i]];
    for (int axis = 0; axis < 3; ++axis) {
      value[axis] = -gradient_[i].linear[axis];
      value[axis + 3] = -gradient_[i].angular[axis];
    }
  }
  solve(plan_, factor_, values_);
  for (std::size_t i = 0; i < twists_.size(); ++i) {
    const BlockVector& value = values_[plan_.place_of[i]];
    direction_[i] = {Vec3(value[0], value[1], value[2]), Vec3(value[3], value[4], value[5])};
  }
  for (std::size_t i = 0; i < change_.size(); ++i) {
    change_[i] = relative_velocity(problem_.points[i], direction_);
  }
  for (std::size_t i = 0; i < turning_change_.size(); ++i)
    turning_change_[i] = relative_velocity(problem_.turnings[i], direction_);
  for (std::size_t i = 0; i < row_change_.size(); ++i)
    row_change_[i] = relative_velocity(problem_.rows[i], direction_);
}

void ConvexMinimisation::move(double step) {
  for (std::size_t k = 0; k < twists_.size(); ++k) {
    twists_[k].linear += direction_[k].linear * step;
    twists_[k].angular += direction_[k].angular * step;
  }
  ++steps_;
  update();
}

double ConvexMinimisation::slope_of_bodies(double step) const {
  double sum = 0.0;
  for (std::size_t i = 0; i < twists_.size(); ++i) {
    const ConvexBody& body = problem_.bodies[i];
    const Twist& d = direction_[i];
    const Vec3 linear = twists_[i].linear - problem_.free[i].linear + d.linear * step;
    const Vec3 angular = twists_[i].angular - problem_.free[i].angular + d.angular * step;
    sum += body.mass_kg * linear.dot(d.linear) + angular.dot(times(body.inertia_kg_m2, d.angular));
  }
  return sum;
}

// slope(0), bit for bit, by the responses that are known.
double ConvexMinimisation::slope_at_start() const {
  double sum = slope_of_bodies(0.0);
  for (std::size_t i = 0; i < change_.size(); ++i)
    if (responses_[i].mode != ContactMode::kOpen)
      sum -= responses_[i].impulse_newton_s.dot(change_[i]);
  for (std::size_t i = 0; i < turning_change_.size(); ++i)
    sum -= all_.turnings[i].impulse_newton_s.dot(turning_change_[i]);
  for (std::size_t i = 0; i < row_change_.size(); ++i)
    sum -= all_.rows[i].impulse_newton_s * row_change_[i];
  return sum;
}

// Derivative of the objective along the direction.
double ConvexMinimisation::slope(double step) const {
  double sum = slope_of_bodies(step);
  const double stiffness_kg = 1.0 / problem_.compliance_1_kg;
  for (std::size_t i = 0; i < change_.size(); ++i) {
    const PointResponse response =
        respond(problem_.points[i], stiffness_kg, velocity_[i] + change_[i] * step);
    if (response.mode != ContactMode::kOpen) sum -= response.impulse_newton_s.dot(change_[i]);
  }
  for (std::size_t i = 0; i < turning_change_.size(); ++i)
    sum -= respond(problem_.turnings[i], stiffness_kg, turning_[i] + turning_change_[i] * step)
               .impulse_newton_s.dot(turning_change_[i]);
  for (std::size_t i = 0; i < row_change_.size(); ++i)
    sum -= respond(problem_.rows[i], row_velocity_[i] + row_change_[i] * step).impulse_newton_s *
           row_change_[i];
  return sum;
}

// The whole step unless the objective rises again before its end; then to where its derivative is a
// small part of that at the start. The derivative never falls, so false position with halving
// (Illinois) finds that.
double ConvexMinimisation::step_length() const {
  constexpr double kFlat = 0.05;
  constexpr int kMostTrials = 20;
  double low = 0.0, high = 1.0;
  double at_low = slope_at_start(), at_high = slope(high);
  const double limit = kFlat * std::abs(at_low);
  if (!(at_low < 0.0) || at_high <= limit) return 1.0;
  for (int i = 0; i < kMostTrials; ++i) {
    const double middle = low + (high - low) * (at_low / (at_low - at_high));
    const double value = slope(middle);
    if (std::abs(value) <= limit) return middle;
    if (value < 0.0) {
      low = middle;
      at_low = value;
      at_high *= 0.5;
    } else {
      high = middle;
      at_high = value;
      at_low *= 0.5;
    }
  }
  return low > 0.0 ? low : high;
}

void ConvexMinimisation::start_from_all_held() {
  constexpr double kTouching = 0.01;  // of the scale
  const double before = objective();
  const std::vector<Twist> guess = twists_;
  twists_ = problem_.free;
  for (std::size_t i = 0; i < responses_.size(); ++i) {
    const ConvexPoint& p = problem_.points[i];
    const Vec3 missing = p.target_m_s - relative_velocity(p, twists_);
    const double closing = missing.dot(p.normal);
    responses_[i] = {};
    if (closing <= -kTouching * limits_.scale_m_s) continue;
    const bool rough = p.friction > 0.0;
    responses_[i].mode = rough ? ContactMode::kStick : ContactMode::kSlide;
    responses_[i].impulse_newton_s =
        (rough ? missing : Vec3(p.normal * closing)) * (1.0 / problem_.compliance_1_kg);
  }
  for (std::size_t i = 0; i < turning_.size(); ++i)
    all_.turnings[i] = respond(problem_.turnings[i], 1.0 / problem_.compliance_1_kg,
                               relative_velocity(problem_.turnings[i], twists_));
  for (std::size_t i = 0; i < row_velocity_.size(); ++i)
    all_.rows[i] = respond(problem_.rows[i], relative_velocity(problem_.rows[i], twists_));
  gradient(problem_, twists_, all_, gradient_);
  if (refactor(false)) {
    find_direction();
    move(1.0);
    if (objective() < before) return;
  }
  twists_ = guess;
  update();
}

bool ConvexMinimisation::minimise(double wanted_m_s, bool accepted) {
  constexpr int kMostSteps = 100;
  // An old factor will do while it takes an error down well, where a new one costs more than steps.
  constexpr double kFast = 0.3;  // of the error, at most what is left of it
  const bool costly = is_costly(plan_, problem_.points.size());
  const double rounding = std::max(limits_.rounding_m_s, rounding_m_s());
  update();
  double error_m_s = gradient_m_s();
  bool is_fast = costly;
  for (int i = 0; i < kMostSteps && error_m_s > wanted_m_s; ++i) {
    if (!(factored_ && is_fast) && !refactor(accepted)) return false;
    find_direction();
    move(step_length());
    const double before = error_m_s;
    error_m_s = gradient_m_s();
    is_fast = costly && error_m_s <= kFast * before;
    // Rounding has ended the descent.
    if (error_m_s <= rounding && error_m_s > 0.25 * before) return true;
  }
  return error_m_s <= std::max(wanted_m_s, rounding);
}

}  // namespace soda::physics
