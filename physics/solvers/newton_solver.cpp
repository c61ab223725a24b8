#include "physics/solvers/newton_solver.hpp"

#include <algorithm>
#include <cmath>

#include "physics/math/anderson.hpp"
#include "physics/solvers/alart_curnier.hpp"
#include "physics/solvers/convex_minimisation.hpp"
#include "physics/solvers/start_impulses.hpp"

namespace soda::physics {
namespace {

// How far the two corrections are from settled, as velocities: that of the compliance, and that of
// the shift.
struct Corrections {
  StartCorrection start;
  double shift_m_s = 0.0;
  double largest_m_s() const { return std::max(start.largest_m_s(), shift_m_s); }
};

// One solve in progress.
class Newton {
 public:
  Newton(const NewtonLimits& limits, const Elimination& plan, ConvexContacts& problem,
         std::vector<Twist>& twists, Responses& responses)
      : limits_(limits),
        plan_(plan),
        problem_(problem),
        twists_(twists),
        responses_(responses),
        minimisation_(limits, plan, problem, twists, responses) {
    laws_.reserve(problem.points.size());
    for (const ConvexPoint& p : problem.points) laws_.push_back(p.target_m_s);
  }

  NewtonOutcome run();

 private:
  double wanted_shift_m_s(std::size_t i) const;
  double start();  // returns what the first correction needs
  Corrections find_corrections();
  void correct(const Corrections& found, const Corrections& last);
  bool harden(const Corrections& found, const Corrections& last);
  bool finish(const Corrections& found);
  double fastest_m_s() const;
  NewtonOutcome outcome(bool converged) const;

  const NewtonLimits& limits_;
  const Elimination& plan_;
  ConvexContacts& problem_;
  std::vector<Twist>& twists_;
  Responses& responses_;
  ConvexMinimisation minimisation_;
  std::vector<Vec3> laws_;  // targets without shift
  // What the corrections change, as velocities: as it was, and as this minimisation says.
  std::vector<double> were_, found_;
  AndersonAcceleration acceleration_;
  double tried_m_s_ = 1e300;  // from where the exact laws were out of reach
};

// The convex law lets a sliding point part by friction times its slip; a target that is lower by as
// much keeps it in touch.
double Newton::wanted_shift_m_s(std::size_t i) const {
  const ConvexPoint& p = problem_.points[i];
  const Vec3 slip = minimisation_.velocities_m_s()[i] - laws_[i];
  return p.friction * (slip - p.normal * slip.dot(p.normal)).norm();
}

// The shifts, and the start impulses: the next minimisation starts from what this one found.
Corrections Newton::find_corrections() {
  Corrections found;
  were_.clear();
  found_.clear();
  for (std::size_t i = 0; i < problem_.points.size(); ++i) {
    const ConvexPoint& p = problem_.points[i];
    were_.push_back((laws_[i] - p.target_m_s).dot(p.normal));
    found_.push_back(wanted_shift_m_s(i));
    found.shift_m_s = std::max(found.shift_m_s, std::abs(found_.back() - were_.back()));
  }
  found.start = append_start_impulses(problem_, responses_, were_, found_);
  return found;
}

// Far from the solution, points open and close, and what they did before says little.
void Newton::correct(const Corrections& found, const Corrections& last) {
  constexpr double kNear = 0.1;  // of the scale
  if (found.largest_m_s() > last.largest_m_s()) acceleration_.restart();
  if (found.largest_m_s() < kNear * limits_.scale_m_s)
    acceleration_.accelerate(were_, found_);
  else
    acceleration_.remember(were_, found_);
  const std::size_t points = problem_.points.size();
  for (std::size_t i = 0; i < points; ++i) {
    ConvexPoint& p = problem_.points[i];
    p.target_m_s = laws_[i];
    if (p.friction > 0.0) p.target_m_s -= p.normal * std::max(0.0, found_[i]);
  }
  set_start_impulses(std::span(found_).subspan(points), problem_);
  set_pressing(responses_.points, problem_);
  keep_closed(responses_, problem_);
}

// By the exact laws, which need no shift: where the shift is what is missing most, and not much of
// it. What comes near may take half as many factorisations more.
bool Newton::finish(const Corrections& found) {
  constexpr double kNear = 0.02;  // of the scale
  constexpr double kAgain = 0.1;  // of the error at the last trial
  constexpr int kShare = 2;       // of the factorisations left
  const double error = found.largest_m_s();
  if (!(found.shift_m_s > found.start.points_m_s) || !(error < kNear * limits_.scale_m_s) ||
      !(error < kAgain * tried_m_s_))
    return false;
  tried_m_s_ = error;
  AlartCurnier exact(limits_, plan_, problem_, minimisation_.body_blocks(), laws_);
  const int left = limits_.factorisations - minimisation_.factorisations();
  const int most = left + limits_.factorisations / kShare;
  const bool done = exact.solve(left / kShare, most, twists_, responses_);
  minimisation_.spend(exact.factorisations());
  return done;
}

// What gives way hardly less than before gets harder; not where more shift is missing, nor for rows
// that contradict each other by rounding. Whether anything did.
bool Newton::harden(const Corrections& found, const Corrections& last) {
  constexpr double kSlow = 0.5;
  constexpr double kHardest = 1e-6;  // of the compliance at the start: beyond, rounding gains
  const auto is_slow = [&](double now, double before) {
    return now > kSlow * before && now > found.shift_m_s;
  };
  const bool points =
      is_slow(found.start.points_m_s, last.start.points_m_s) && minimisation_.softness() > kHardest;
  const bool rows = is_slow(found.start.rows_m_s, last.start.rows_m_s) &&
                    found.start.rows_m_s > limits_.rounding_m_s &&
                    minimisation_.row_stiffness() * kHardest < 1.0;
  if (points) minimisation_.harden_points();
  if (rows) minimisation_.harden_rows();
  return points || rows;
}

double Newton::start() {
  constexpr double kSettled = 0.01;  // of the scale: the guess is good
  constexpr double kFirst = 0.01;    // of the scale, and kNearer of the guess's error
  constexpr double kNearer = 0.1;
  minimisation_.update();
  for (std::size_t i = 0; i < problem_.points.size(); ++i)
    problem_.points[i].target_m_s = laws_[i] - problem_.points[i].normal * wanted_shift_m_s(i);
  minimisation_.update();
  if (minimisation_.gradient_m_s() > kSettled * limits_.scale_m_s)
    minimisation_.start_from_all_held();
  return std::min(kFirst * limits_.scale_m_s,
                  std::max(limits_.rounding_m_s, kNearer * minimisation_.gradient_m_s()));
}

double Newton::fastest_m_s() const {
  double squared = 0.0;
  for (const ConvexPoint& p : problem_.points) {
    const Vec3 other = p.b < twists_.size() ? twists_[p.b].linear : Vec3(Vec3::Zero());
    squared = std::max(squared, (twists_[p.a].linear - other).squaredNorm());
  }
  return std::min(std::sqrt(squared), limits_.scale_m_s);
}

NewtonOutcome Newton::outcome(bool converged) const {
  return {converged, minimisation_.factorisations(), minimisation_.steps()};
}

NewtonOutcome Newton::run() {
  constexpr double kStays = 0.5, kAtOnce = 0.9;  // of the error before: it does not change any more
  std::vector<Twist> good_twists;
  Responses good_responses;
  bool accepted = false;
  double wanted = start(), last_error = 0.0;
  Corrections last;
  for (int i = 0; i < limits_.corrections && minimisation_.minimise(wanted, accepted); ++i) {
    const Corrections found = find_corrections();
    const double gradient = minimisation_.gradient_m_s(), correction = found.largest_m_s();
    const double error = std::max(gradient, correction);
    if (error <= limits_.accepted_m_s) {
      const double rounding = minimisation_.rounding_m_s();
      if (correction <= limits_.wanted_m_s && gradient <= std::max(limits_.wanted_m_s, rounding))
        return outcome(true);
      // What does not change at all is a contradiction between points, of the size of rounding.
      const double most = (i > 3 ? kStays : kAtOnce) * last_error;
      if (error <= limits_.rounding_m_s && i > 0 && correction > most) return outcome(true);
      if (minimisation_.factorisations() >= limits_.many &&
          error <= limits_.of_motion * fastest_m_s())
        return outcome(true);
      accepted = true;
      good_twists = twists_;
      good_responses = responses_;
    }
    if (finish(found)) return outcome(true);
    correct(found, last);
    if (i > 0 && harden(found, last)) acceleration_.restart();
    wanted = std::max(limits_.wanted_m_s, correction);
    last = found;
    last_error = error;
  }
  if (accepted) {
    twists_ = good_twists;
    responses_ = good_responses;
  }
  return outcome(accepted);
}

}  // namespace

bool is_costly(const Elimination& plan, std::size_t points) {
  constexpr double kCostly = 500.0;  // multiplications a point
  return plan.multiplications > kCostly * static_cast<double>(points);
}

NewtonOutcome solve_by_newton(const NewtonLimits& limits, const Elimination& plan,
                              ConvexContacts& problem, std::vector<Twist>& twists,
                              Responses& responses) {
  responses.points.resize(problem.points.size());
  responses.turnings.resize(problem.turnings.size());
  responses.rows.resize(problem.rows.size());
  return Newton(limits, plan, problem, twists, responses).run();
}

}  // namespace soda::physics
