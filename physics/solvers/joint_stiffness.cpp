#include "physics/solvers/joint_stiffness.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "physics/constraints/joint_anchor.hpp"
#include "physics/constraints/rolling_rows.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/solvers/convex_contacts.hpp"
#include "physics/solvers/direct_contacts.hpp"

namespace soda::physics {
namespace {

// Of a force that acts at an arm: by what torque it turns the arm back to itself, for small turns:
// (f . r) 1 - (f r^T + r f^T) / 2. Its eigenvalues are f . r and (f . r +- |f| |r|) / 2; the
// negative one is left out, and all of a force that pushes: bodies would have less than no inertia.
Mat3 stiffness_of(const Vec3& arm, const Vec3& force) {
  const double along = force.dot(arm);
  if (!(along > 0.0)) return Mat3::Zero();
  const double size = std::sqrt(force.squaredNorm() * arm.squaredNorm());
  const double cosine = along / size;
  const Vec3 middle = force / std::sqrt(force.squaredNorm()) + arm / std::sqrt(arm.squaredNorm());
  return along * Mat3::Identity() - 0.5 * (force * arm.transpose() + arm * force.transpose()) +
         (size * (1.0 - cosine) / (4.0 * (1.0 + cosine))) * (middle * middle.transpose());
}

Vec3 impulse_of(const JointSystem& solved, std::size_t place) {
  Vec3 impulse = Vec3::Zero();
  for (std::uint32_t r = solved.first_row[place]; r < solved.first_row[place + 1]; ++r)
    impulse += solved.rows[r].linear * solved.rows[r].impulse_newton_s;
  return impulse;
}

bool is_line(const Joint& joint) {
  return joint.kind == JointKind::kDistance || joint.kind == JointKind::kSpring;
}

// Two rows across the line of a joint, for a pull of that impulse in a step.
void append_across(const Joint& joint, double pull_newton_s, double dt_s,
                   std::span<const BodyState> there, std::span<const SolverBody> bodies,
                   std::vector<JointRow>& rows) {
  const JointRow along = rows.back();
  const JointAnchor a = anchor_of(there, along.a, joint.anchor_a_m);
  const JointAnchor b = anchor_of(there, along.b, joint.anchor_b_m);
  const double length_m = Vec3(b.place_m - a.place_m).norm();
  const bool pulls = pull_newton_s > 0.0 && length_m > 0.0;
  const Tangents tangents = tangents_of(along.linear);
  for (const Vec3& across : {tangents.first, tangents.second}) {
    JointRow& row = rows.emplace_back();
    row.a = along.a;
    row.b = along.b;
    row.kind = JointRowKind::kStiffness;
    if (!pulls) continue;
    row.linear = across;
    row.angular_a = a.arm.cross(across);
    row.angular_b = b.arm.cross(across);
    row.softness_1_kg = length_m / (pull_newton_s * dt_s);
    row.target_m_s = velocity_of(row, bodies);
  }
}

// The system with other rows.
void change_rows(std::vector<JointRow> rows, std::vector<std::uint32_t> first_row,
                 JointSystem& system) {
  system.rows = std::move(rows);
  system.first_row = std::move(first_row);
  system.factored = false;
  std::swap(system.elimination, system.other_elimination);
}

}  // namespace

bool are_even(const SceneDescription& scene, std::span<const BodyId> ids) {
  constexpr double kMostRatio = 1e6;
  return mass_ratio(scene, ids) <= kMostRatio;
}

void stiffen(const SceneDescription& scene, double dt_s, std::span<const BodyState> there,
             const JointSystem& solved, std::span<const SolverBody> free,
             std::span<SolverBody> bodies) {
  std::vector<Mat3> stiffness(free.size(), Mat3::Zero());
  const auto add = [&](std::uint32_t body, const Vec3& anchor_m, const Vec3& impulse) {
    if (body >= free.size()) return;
    stiffness[body] += stiffness_of(there[body].orientation * anchor_m, impulse);
  };
  for (std::size_t place = 0; place < solved.joints.size(); ++place) {
    const Joint& joint = scene.joints[solved.joints[place]];
    const Vec3 impulse = impulse_of(solved, place);
    add(solved.bodies[place][0], joint.anchor_a_m, -impulse);
    add(solved.bodies[place][1], joint.anchor_b_m, impulse);
  }
  for (std::size_t i = 0; i < free.size(); ++i) {
    const Vec3 old = bodies[i].angular;
    bodies[i] = free[i];
    if (free[i].inverse_mass == 0.0) continue;  // kinematic
    const Mat3 inertia = inverse_of_symmetric(free[i].inverse_inertia);
    bodies[i].inverse_inertia = inverse_of_symmetric(inertia + dt_s * stiffness[i]);
    bodies[i].angular = old + bodies[i].inverse_inertia * Vec3(inertia * (free[i].angular - old));
  }
}

void unstiffen(std::span<const SolverBody> free, std::span<SolverBody> bodies) {
  for (std::size_t i = 0; i < free.size(); ++i) bodies[i].inverse_inertia = free[i].inverse_inertia;
}

void add_stiffness_rows(const SceneDescription& scene, double dt_s,
                        std::span<const BodyState> there, const JointSystem& solved,
                        std::span<const SolverBody> bodies, JointSystem& system) {
  const auto joint_at = [&](std::size_t place) -> const Joint& {
    return scene.joints[system.joints[place]];
  };
  const auto is_line_at = [&](std::uint32_t joint) { return is_line(scene.joints[joint]); };
  if (std::ranges::none_of(system.joints, is_line_at)) return;
  std::vector<JointRow> rows;
  std::vector<std::uint32_t> first_row = {0};
  for (std::size_t place = 0; place < system.joints.size(); ++place) {
    for (std::uint32_t r = system.first_row[place]; r < system.first_row[place + 1]; ++r)
      rows.push_back(system.rows[r]);
    if (is_line(joint_at(place))) {
      const double pull = -solved.rows[solved.first_row[place]].impulse_newton_s;
      append_across(joint_at(place), pull, dt_s, there, bodies, rows);
    }
    first_row.push_back(static_cast<std::uint32_t>(rows.size()));
  }
  change_rows(std::move(rows), std::move(first_row), system);
}

void drop_stiffness_rows(JointSystem& system) {
  system.dropped.clear();
  if (std::ranges::find(system.rows, JointRowKind::kStiffness, &JointRow::kind) ==
      system.rows.end())
    return;
  std::vector<JointRow> rows;
  std::vector<std::uint32_t> first_row = {0};
  for (std::size_t place = 0; place < system.joints.size(); ++place) {
    for (std::uint32_t r = system.first_row[place]; r < system.first_row[place + 1]; ++r) {
      const JointRow& row = system.rows[r];
      (row.kind == JointRowKind::kStiffness ? system.dropped : rows).push_back(row);
    }
    first_row.push_back(static_cast<std::uint32_t>(rows.size()));
  }
  change_rows(std::move(rows), std::move(first_row), system);
}

}  // namespace soda::physics
