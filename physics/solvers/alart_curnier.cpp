#include "physics/solvers/alart_curnier.hpp"

#include <algorithm>
#include <cmath>

namespace soda::physics {
namespace {

PointResponse respond_exactly(const ConvexPoint& p, double stiffness_kg, const Vec3& velocity_m_s) {
  const Vec3 y = p.start_newton_s + (p.target_m_s - velocity_m_s) * stiffness_kg;
  const double normal = y.dot(p.normal);
  PointResponse out;
  if (!(normal > 0.0)) return out;
  const Vec3 tangential = y - p.normal * normal;
  const double size = tangential.norm();
  if (size <= p.friction * normal) {
    out.mode = ContactMode::kStick;
    out.impulse_newton_s = y;
    return out;
  }
  out.mode = ContactMode::kSlide;
  out.along = tangential * (1.0 / size);
  out.impulse_newton_s = p.normal * normal + out.along * (p.friction * normal);
  out.aside = p.friction * normal / size;
  return out;
}

// The least k >= 0 at which |t + k dt| = friction (n + k dn); none: 1e300.
double growths_until_slip(const ConvexPoint& p, const Vec3& impulse, const Vec3& growth) {
  const double n = impulse.dot(p.normal), dn = growth.dot(p.normal);
  const Vec3 t = impulse - p.normal * n, dt = growth - p.normal * dn;
  const double squared = p.friction * p.friction;
  const double a = dt.squaredNorm() - squared * dn * dn;
  const double b = t.dot(dt) - squared * n * dn;
  const double c = t.squaredNorm() - squared * n * n;
  if (c >= 0.0) return b > 0.0 ? 0.0 : 1e300;
  const double discriminant = b * b - a * c;
  if (a > 0.0) return -c / (b + std::sqrt(discriminant));
  return b > 0.0 && discriminant >= 0.0 ? -c / (b + std::sqrt(discriminant)) : 1e300;
}

}  // namespace

AlartCurnier::AlartCurnier(const NewtonLimits& limits, const Elimination& plan,
                           const ConvexContacts& problem, BodyBlocks& bodies,
                           std::span<const Vec3> targets)
    : limits_(limits),
      plan_(plan),
      problem_(problem),
      bodies_(bodies),
      values_(problem.bodies.size()) {
  for (std::size_t i = 0; i < targets.size(); ++i) problem_.points[i].target_m_s = targets[i];
}

void AlartCurnier::update() {
  const double stiffness_kg = 1.0 / problem_.compliance_1_kg;
  for (std::size_t i = 0; i < responses_.points.size(); ++i)
    responses_.points[i] = respond_exactly(problem_.points[i], stiffness_kg,
                                           relative_velocity(problem_.points[i], twists_));
  set_pressing(responses_.points, problem_);
  for (std::size_t i = 0; i < responses_.turnings.size(); ++i)
    responses_.turnings[i] = respond(problem_.turnings[i], stiffness_kg,
                                     relative_velocity(problem_.turnings[i], twists_));
  for (std::size_t i = 0; i < responses_.rows.size(); ++i)
    responses_.rows[i] = respond(problem_.rows[i], relative_velocity(problem_.rows[i], twists_));
  gradient(problem_, twists_, responses_, gradient_);
}

// Whether every point and row answers as when the factor was made.
bool AlartCurnier::fits_factor() const {
  if (factor_modes_.size() != responses_.points.size()) return false;
  for (std::size_t i = 0; i < factor_modes_.size(); ++i)
    if (responses_.points[i].mode != factor_modes_[i]) return false;
  for (std::size_t i = 0; i < factor_turnings_.size(); ++i)
    if (!responses_.turnings[i].is_bounded_as(factor_turnings_[i])) return false;
  for (std::size_t i = 0; i < factor_held_.size(); ++i)
    if (responses_.rows[i].held != factor_held_[i]) return false;
  return true;
}

bool AlartCurnier::refactor() {
  assemble(problem_, plan_, responses_, bodies_, factor_);
  ++factorisations_;
  if (!factorise(plan_, factor_)) return false;
  factor_modes_.clear();
  factor_held_.clear();
  for (const PointResponse& response : responses_.points) factor_modes_.push_back(response.mode);
  factor_turnings_ = responses_.turnings;
  for (const RowResponse& response : responses_.rows) factor_held_.push_back(response.held);
  return true;
}

void AlartCurnier::find_direction() {
  for (std::size_t i = 0; i < twists_.size(); ++i) {
    BlockVector& value = values_[plan_.place_of[i]];
    for (int axis = 0; axis < 3; ++axis) {
      value[axis] = -gradient_[i].linear[axis];
      value[axis + 3] = -gradient_[i].angular[axis];
    }
  }
  physics::solve(plan_, factor_, values_);
}

void AlartCurnier::move(double step) {
  for (std::size_t i = 0; i < twists_.size(); ++i) {
    const BlockVector& value = values_[plan_.place_of[i]];
    twists_[i].linear += Vec3(value[0], value[1], value[2]) * step;
    twists_[i].angular += Vec3(value[3], value[4], value[5]) * step;
  }
  update();
}

// The whole step, or less of it where that leaves more of the gradient than there was: points that
// open and close together can do so for ever.
double AlartCurnier::step(double before_m_s) {
  constexpr int kMostHalvings = 3;
  find_direction();
  move(1.0);
  double left = largest_m_s(problem_, gradient_), taken = 1.0;
  for (int i = 0; i < kMostHalvings && left >= before_m_s; ++i) {
    taken *= 0.5;
    move(-taken);
    left = largest_m_s(problem_, gradient_);
  }
  return left;
}

// By how many times what the last correction added impulses can grow until a point lets go, or a
// row is at its bound.
double AlartCurnier::growths_until_release() const {
  double least = 1e300;
  for (std::size_t i = 0; i < responses_.points.size(); ++i) {
    const ConvexPoint& p = problem_.points[i];
    const PointResponse& response = responses_.points[i];
    if (response.mode == ContactMode::kOpen) continue;
    const Vec3& impulse = response.impulse_newton_s;
    const Vec3 growth = impulse - p.start_newton_s;
    if (growth.dot(p.normal) < 0.0)
      least = std::min(least, -impulse.dot(p.normal) / growth.dot(p.normal));
    if (response.mode == ContactMode::kStick)
      least = std::min(least, growths_until_slip(p, impulse, growth));
  }
  for (std::size_t i = 0; i < responses_.rows.size(); ++i) {
    const ConvexRow& row = problem_.rows[i];
    if (row.soft || !responses_.rows[i].held) continue;
    const double impulse = responses_.rows[i].impulse_newton_s;
    const double growth = impulse - row.start_newton_s;
    if (growth > 0.0) least = std::min(least, (row.most_newton_s - impulse) / growth);
    if (growth < 0.0) least = std::min(least, (row.least_newton_s - impulse) / growth);
  }
  return least;
}

// From the impulses found. Where these grow by as much each time, in balance with each other,
// nothing changes until a point lets go: so they grow as far at once. False if that is too often.
bool AlartCurnier::start_again(double gradient_m_s, const StartCorrection& found,
                               Progress& progress) {
  constexpr double kAlike = 0.02, kBalanced = 0.1;  // of the correction
  constexpr double kMostGrowths = 1e5;
  constexpr int kMostReleases = 10;
  const double now = found.largest_m_s(), before = progress.last.largest_m_s();
  const bool grows = gradient_m_s < kBalanced * now && std::abs(now - before) < kAlike * now &&
                     progress.last_modes == factor_modes_;
  const double growths = grows ? growths_until_release() : 0.0;
  progress.last = found;
  progress.last_modes = factor_modes_;
  const bool released = growths > 1.0 && growths < kMostGrowths;
  if (released) {
    constexpr double kBeyond = 0.01;
    if (++progress.releases > kMostReleases) return false;
    const double times = 2.0 + (1.0 + kBeyond) * growths;
    for (std::size_t k = 0; k < found_.size(); ++k)
      found_[k] = were_[k] + times * (found_[k] - were_[k]);
    acceleration_.restart();
    progress.best_m_s = 1e300;
    progress.no_nearer = 0;
  } else {
    if (now > before) acceleration_.restart();
    acceleration_.accelerate(were_, found_);
  }
  set_start_impulses(found_, problem_);
  if (!released) keep_closed(responses_, problem_);
  update();
  return true;
}

// Whether the work ends here.
bool AlartCurnier::judge(double gradient_m_s, const StartCorrection& found,
                         Progress& progress) const {
  constexpr double kNearer = 0.5;
  constexpr int kPatience = 3;
  const double error = std::max(gradient_m_s, found.largest_m_s());
  if (error <= limits_.wanted_m_s) return true;
  if (error < kNearer * progress.best_m_s) {
    progress.best_m_s = error;
    progress.no_nearer = 0;
    return false;
  }
  return ++progress.no_nearer > kPatience;
}

bool AlartCurnier::solve(int least, int most, std::vector<Twist>& twists, Responses& responses) {
  constexpr int kMostSteps = 60;
  constexpr double kFast = 0.1;  // of the gradient, at most what is left of it
  twists_ = twists;
  responses_ = responses;
  append_start_impulses(problem_, responses_, were_, found_);
  set_start_impulses(found_, problem_);
  update();
  Progress progress;
  const double stalled = std::max(limits_.stalled_m_s, limits_.rounding_m_s);
  for (int i = 0; i < kMostSteps; ++i) {
    const bool is_near = progress.best_m_s <= limits_.accepted_m_s;
    if (!(progress.is_fast && fits_factor()))
      if (factorisations_ >= (is_near ? most : least) || !refactor()) break;
    const double before = largest_m_s(problem_, gradient_);
    const double gradient = step(before);
    progress.is_fast = gradient < kFast * before;
    were_.clear();
    found_.clear();
    const StartCorrection found = append_start_impulses(problem_, responses_, were_, found_);
    const double error = std::max(gradient, found.largest_m_s());
    if (error <= stalled && error < progress.accepted_m_s) {
      progress.accepted_m_s = error;
      twists = twists_;
      responses = responses_;
    }
    if (judge(gradient, found, progress)) break;
    if (gradient <= found.largest_m_s() && !start_again(gradient, found, progress)) break;
  }
  return progress.accepted_m_s < 1e300;
}

}  // namespace soda::physics
