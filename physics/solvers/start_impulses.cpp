#include "physics/solvers/start_impulses.hpp"

#include <cmath>

namespace soda::physics {
namespace {

double compliance_of(const ConvexRow& row) { return row.speed / row.stiffness_kg; }

}  // namespace

StartCorrection append_start_impulses(const ConvexContacts& problem, const Responses& responses,
                                      std::vector<double>& were, std::vector<double>& found) {
  StartCorrection correction;
  double squared = 0.0;
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    const ConvexPoint& p = problem.points[i];
    const Vec3& impulse = responses.points[i].impulse_newton_s;
    squared = std::max(squared, (impulse - p.start_newton_s).squaredNorm());
    for (int axis = 0; axis < 3; ++axis) {
      were.push_back(p.start_newton_s[axis] * problem.compliance_1_kg);
      found.push_back(impulse[axis] * problem.compliance_1_kg);
    }
  }
  for (std::size_t i = 0; i < problem.turnings.size(); ++i) {
    const ConvexTurning& turning = problem.turnings[i];
    const double pressed = pressing(turning, problem.points, responses.points);
    const Vec3 impulse =
        bounded(turning, pressed, responses.turnings[i].wanted_newton_s).impulse_newton_s;
    squared = std::max(squared, (impulse - turning.start_newton_s).squaredNorm());
    squared = std::max(squared, (impulse - responses.turnings[i].impulse_newton_s).squaredNorm());
    for (int axis = 0; axis < 3; ++axis) {
      were.push_back(turning.start_newton_s[axis] * problem.compliance_1_kg);
      found.push_back(impulse[axis] * problem.compliance_1_kg);
    }
  }
  correction.points_m_s = std::sqrt(squared) * problem.compliance_1_kg;
  for (std::size_t i = 0; i < problem.rows.size(); ++i) {
    const ConvexRow& row = problem.rows[i];
    if (row.soft) continue;
    were.push_back(row.start_newton_s * compliance_of(row));
    found.push_back(responses.rows[i].impulse_newton_s * compliance_of(row));
    correction.rows_m_s = std::max(correction.rows_m_s, std::abs(found.back() - were.back()));
  }
  return correction;
}

void set_start_impulses(std::span<const double> values, ConvexContacts& problem) {
  auto next = values.begin();
  const auto take = [&](Vec3& start) {
    for (int axis = 0; axis < 3; ++axis) start[axis] = *next++ / problem.compliance_1_kg;
  };
  for (ConvexPoint& p : problem.points) take(p.start_newton_s);
  for (ConvexTurning& turning : problem.turnings) take(turning.start_newton_s);
  for (ConvexRow& row : problem.rows)
    if (!row.soft) row.start_newton_s = *next++ / compliance_of(row);
}

void set_pressing(std::span<const PointResponse> responses, ConvexContacts& problem) {
  for (ConvexTurning& turning : problem.turnings)
    turning.pressing_newton_s = pressing(turning, problem.points, responses);
}

void keep_closed(const Responses& responses, ConvexContacts& problem) {
  constexpr double kLeast = 0.5;  // of what a closed point bears
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    ConvexPoint& p = problem.points[i];
    const PointResponse& response = responses.points[i];
    if (response.mode == ContactMode::kOpen) {
      p.start_newton_s = response.impulse_newton_s;
      continue;
    }
    const double least = kLeast * response.impulse_newton_s.dot(p.normal);
    p.start_newton_s += p.normal * std::max(0.0, least - p.start_newton_s.dot(p.normal));
  }
}

}  // namespace soda::physics
