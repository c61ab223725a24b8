#include "physics/solvers/newton_solver.hpp"

#include <algorithm>
#include <cmath>

#include "physics/math/rigid_motion.hpp"

namespace soda::physics {
namespace {

// One Newton solve in progress.
class Newton {
 public:
  Newton(const NewtonLimits& limits, const Elimination& plan, ConvexContacts& problem,
         std::vector<Twist>& twists, Responses& responses)
      : limits_(limits),
        plan_(plan),
        problem_(problem),
        twists_(twists),
        all_(responses),
        responses_(responses.points),
        softest_1_kg_(problem.compliance_1_kg) {
    const std::size_t points = problem.points.size();
    responses_.resize(points);
    factor_modes_.resize(points);
    velocity_.resize(points);
    change_.resize(points);
    all_.rows.resize(problem.rows.size());
    factor_held_.resize(problem.rows.size());
    row_velocity_.resize(problem.rows.size());
    row_change_.resize(problem.rows.size());
    laws_.reserve(points);
    for (const ConvexPoint& p : problem.points) laws_.push_back(p.target_m_s);
  }

  NewtonOutcome run();

 private:
  void update_responses();
  double gradient_m_s() const;
  double rounding_m_s() const;
  double objective() const;
  void start_from_all_held();
  bool minimise(double wanted_m_s);  // false if the limits are used up
  bool fits_factor() const;
  bool refactor();  // unless it fits
  void find_direction();
  void move(double step);
  double slope_of_bodies(double step) const;
  double slope_at_start() const;
  double slope(double step) const;
  double step_length() const;
  double shift_targets();
  double take_compliance_out();

  const NewtonLimits& limits_;
  const Elimination& plan_;
  ConvexContacts& problem_;
  std::vector<Twist>& twists_;
  Responses& all_;
  std::vector<PointResponse>& responses_;  // of the points
  NewtonOutcome outcome_;
  int further_ = 0;                                // factorisations since an error was accepted
  double error_m_s_ = 0.0;                         // of the minimisation
  double softest_1_kg_ = 0.0;                      // compliance at the start
  std::vector<Vec3> laws_;                         // targets without shift
  std::vector<Vec3> velocity_, change_;            // of the points; along the direction
  std::vector<double> row_velocity_, row_change_;  // the same of the rows
  std::vector<Twist> gradient_, direction_;
  std::vector<Block> factor_;
  std::vector<BlockVector> values_;
  std::vector<ContactMode> factor_modes_;
  std::vector<bool> factor_held_;  // of the rows
  bool factored_ = false;
};

void Newton::update_responses() {
  const double stiffness_kg = 1.0 / problem_.compliance_1_kg;
  for (std::size_t i = 0; i < responses_.size(); ++i) {
    velocity_[i] = relative_velocity(problem_.points[i], twists_);
    responses_[i] = respond(problem_.points[i], stiffness_kg, velocity_[i]);
  }
  for (std::size_t i = 0; i < row_velocity_.size(); ++i) {
    row_velocity_[i] = relative_velocity(problem_.rows[i], twists_);
    all_.rows[i] = respond(problem_.rows[i], row_velocity_[i]);
  }
  gradient(problem_, twists_, all_, gradient_);
}

// The largest speed that a body alone would get from what is missing in its balance; of spins, that
// of the same energy.
double Newton::gradient_m_s() const {
  double squared = 0.0;
  for (std::size_t i = 0; i < gradient_.size(); ++i) {
    const double mass = problem_.bodies[i].mass_kg;
    const double moment = problem_.bodies[i].inertia_kg_m2.trace() / 3.0;
    squared = std::max(squared, gradient_[i].linear.squaredNorm() / (mass * mass));
    squared = std::max(squared, gradient_[i].angular.squaredNorm() / (mass * moment));
  }
  return std::sqrt(squared);
}

// What rounding leaves of it grows with the stiffness of points.
double Newton::rounding_m_s() const {
  constexpr double kOfScale = 1e-15;
  return std::max(limits_.rounding_m_s,
                  kOfScale * limits_.scale_m_s * (softest_1_kg_ / problem_.compliance_1_kg));
}

double Newton::objective() const {
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
bool Newton::fits_factor() const {
  bool same = factored_;
  for (std::size_t i = 0; same && i < responses_.size(); ++i) {
    const ContactMode mode = responses_[i].mode;
    same = mode == factor_modes_[i] &&
           (mode != ContactMode::kSlide || problem_.points[i].friction == 0.0);
  }
  for (std::size_t i = 0; same && i < factor_held_.size(); ++i)
    same = factor_held_[i] == all_.rows[i].held;
  return same;
}

bool Newton::refactor() {
  if (fits_factor()) return true;
  if (outcome_.factorisations >= limits_.factorisations) return false;
  if (outcome_.converged && further_++ >= limits_.further) return false;
  ++outcome_.factorisations;
  assemble(problem_, plan_, all_, factor_);
  factored_ = factorise(plan_, factor_);
  for (std::size_t i = 0; i < responses_.size(); ++i) factor_modes_[i] = responses_[i].mode;
  for (std::size_t i = 0; i < factor_held_.size(); ++i) factor_held_[i] = all_.rows[i].held;
  return factored_;
}

void Newton::find_direction() {
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
  for (std::size_t i = 0; i < row_change_.size(); ++i)
    row_change_[i] = relative_velocity(problem_.rows[i], direction_);
}

void Newton::move(double step) {
  for (std::size_t k = 0; k < twists_.size(); ++k) {
    twists_[k].linear += direction_[k].linear * step;
    twists_[k].angular += direction_[k].angular * step;
  }
  ++outcome_.steps;
  update_responses();
}

double Newton::slope_of_bodies(double step) const {
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
double Newton::slope_at_start() const {
  double sum = slope_of_bodies(0.0);
  for (std::size_t i = 0; i < change_.size(); ++i)
    if (responses_[i].mode != ContactMode::kOpen)
      sum -= responses_[i].impulse_newton_s.dot(change_[i]);
  for (std::size_t i = 0; i < row_change_.size(); ++i)
    sum -= all_.rows[i].impulse_newton_s * row_change_[i];
  return sum;
}

// Derivative of the objective along the direction.
double Newton::slope(double step) const {
  double sum = slope_of_bodies(step);
  const double stiffness_kg = 1.0 / problem_.compliance_1_kg;
  for (std::size_t i = 0; i < change_.size(); ++i) {
    const PointResponse response =
        respond(problem_.points[i], stiffness_kg, velocity_[i] + change_[i] * step);
    if (response.mode != ContactMode::kOpen) sum -= response.impulse_newton_s.dot(change_[i]);
  }
  for (std::size_t i = 0; i < row_change_.size(); ++i)
    sum -= respond(problem_.rows[i], row_velocity_[i] + row_change_[i] * step).impulse_newton_s *
           row_change_[i];
  return sum;
}

// The whole step unless the objective rises again before its end; then to where its derivative is a
// small part of that at the start. The derivative never falls, so false position with halving
// (Illinois) finds that.
double Newton::step_length() const {
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

// Another guess: every point that would close is held. What rests, but has no impulses of an
// earlier step, is found in this one solve; else layer by layer.
void Newton::start_from_all_held() {
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
  for (std::size_t i = 0; i < row_velocity_.size(); ++i)
    all_.rows[i] = respond(problem_.rows[i], relative_velocity(problem_.rows[i], twists_));
  gradient(problem_, twists_, all_, gradient_);
  if (refactor()) {
    find_direction();
    move(1.0);
    if (objective() < before) return;
  }
  twists_ = guess;
  update_responses();
}

// Newton's method for the present targets and start impulses.
bool Newton::minimise(double wanted_m_s) {
  constexpr int kMostSteps = 100;
  // An old factor will do while it takes an error down well, where a new one costs more than steps.
  constexpr double kFast = 0.3;  // of the error, at most what is left of it
  const bool costly = is_costly(plan_, problem_.points.size());
  update_responses();
  error_m_s_ = gradient_m_s();
  bool is_fast = costly;
  for (int i = 0; i < kMostSteps && error_m_s_ > wanted_m_s; ++i) {
    if (!(factored_ && is_fast) && !refactor()) return false;
    find_direction();
    move(step_length());
    const double before = error_m_s_;
    error_m_s_ = gradient_m_s();
    is_fast = costly && error_m_s_ <= kFast * before;
    // Rounding has ended the descent.
    if (error_m_s_ <= rounding_m_s() && error_m_s_ > 0.25 * before) return true;
  }
  return error_m_s_ <= std::max(wanted_m_s, rounding_m_s());
}

// The convex law lets a sliding point part by friction times its slip; a target that is lower by as
// much keeps it in touch. Returns the largest change.
double Newton::shift_targets() {
  double largest = 0.0;
  for (std::size_t i = 0; i < velocity_.size(); ++i) {
    ConvexPoint& p = problem_.points[i];
    if (p.friction == 0.0) continue;
    const Vec3 slip = velocity_[i] - laws_[i];
    const Vec3 tangential = slip - p.normal * slip.dot(p.normal);
    const Vec3 target = laws_[i] - p.normal * (p.friction * tangential.norm());
    largest = std::max(largest, (target - p.target_m_s).norm());
    p.target_m_s = target;
  }
  return largest;
}

// Starts again from the impulses found. Returns the largest velocity that the compliance gave way.
double Newton::take_compliance_out() {
  double squared = 0.0;
  for (std::size_t i = 0; i < responses_.size(); ++i) {
    ConvexPoint& p = problem_.points[i];
    const Vec3 change = responses_[i].impulse_newton_s - p.start_newton_s;
    squared = std::max(squared, change.squaredNorm());
    p.start_newton_s = responses_[i].impulse_newton_s;
  }
  double largest = std::sqrt(squared) * problem_.compliance_1_kg;
  for (std::size_t i = 0; i < all_.rows.size(); ++i) {
    ConvexRow& row = problem_.rows[i];
    if (row.soft) continue;
    const double change = all_.rows[i].impulse_newton_s - row.start_newton_s;
    largest = std::max(largest, std::abs(change) / row.stiffness_kg * row.speed);
    row.start_newton_s = all_.rows[i].impulse_newton_s;
  }
  return largest;
}

NewtonOutcome Newton::run() {
  constexpr double kSettled = 0.01;  // of the scale: the guess is good
  constexpr double kInexact = 0.1;   // of the last correction: what its successor needs
  constexpr double kSlow = 0.25;     // a correction over the one before
  constexpr double kHarder = 0.1;
  const double hardest = 1e-6 * problem_.compliance_1_kg;  // beyond, rounding gains
  update_responses();
  shift_targets();
  update_responses();
  if (gradient_m_s() > kSettled * limits_.scale_m_s) start_from_all_held();
  std::vector<Twist> good_twists;
  Responses good_responses;
  double wanted = std::max(limits_.wanted_m_s, limits_.first_m_s), last = 0.0, last_gave = 0.0;
  for (int i = 0; i < limits_.corrections && minimise(wanted); ++i) {
    const double shift = shift_targets();
    const double gave = take_compliance_out();
    const double correction = std::max(gave, shift);
    const double error = std::max(error_m_s_, correction);
    if (error <= limits_.accepted_m_s) {
      outcome_.converged = true;
      if (error <= limits_.wanted_m_s) return outcome_;
      // What does not change at all is a contradiction between points, of the size of rounding.
      const double most = i > 3 ? 0.5 : 0.9;
      if (error <= limits_.rounding_m_s && i > 0 && correction > most * last) return outcome_;
      good_twists = twists_;
      good_responses = all_;
    }
    const bool is_slow = limits_.counts == 0.0
                             ? correction > kSlow * last
                             : gave > kSlow * last_gave && gave > limits_.counts * shift;
    if (i > 0 && is_slow && problem_.compliance_1_kg > hardest) {
      problem_.compliance_1_kg *= kHarder;
      for (ConvexRow& row : problem_.rows)
        if (!row.soft) row.stiffness_kg /= kHarder;
      factored_ = false;
    }
    wanted = std::max(limits_.wanted_m_s, kInexact * correction);
    last = correction;
    last_gave = gave;
  }
  if (outcome_.converged) {
    twists_ = good_twists;
    all_ = good_responses;
  }
  return outcome_;
}

}  // namespace

bool is_costly(const Elimination& plan, std::size_t points) {
  constexpr double kCostly = 500.0;  // multiplications a point
  return plan.multiplications > kCostly * static_cast<double>(points);
}

NewtonOutcome solve_by_newton(const NewtonLimits& limits, const Elimination& plan,
                              ConvexContacts& problem, std::vector<Twist>& twists,
                              Responses& responses) {
  return Newton(limits, plan, problem, twists, responses).run();
}

}  // namespace soda::physics
