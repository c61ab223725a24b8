#include "physics/constraints/carried_rows.hpp"

#include "physics/math/rigid_motion.hpp"
#include "physics/model/kinematic.hpp"

namespace soda::physics {
namespace {

// The mean over `length_s` of what `arm` turns to, less the arm.
Vec3 mean_turned(const Vec3& angular_velocity, double length_s, const Vec3& arm) {
  const Vec3 angle = angular_velocity * length_s;
  const double squared = angle.squaredNorm();
  if (squared == 0.0) return Vec3::Zero();  // also where the square is too small
  const Quat rotation = rotation_by(angle);
  const Vec3 half(rotation.x(), rotation.y(), rotation.z());  // axis times sine of half of it
  const double share = 2.0 * half.dot(angle) / squared;
  const Vec3 across = arm - angle * (angle.dot(arm) / squared);
  return across * (share * rotation.w() - 1.0) + half.cross(arm) * share;
}

Vec3 turned_by(const Vec3& angle_rad, const Vec3& arm) { return rotation_by(angle_rad) * arm; }

void move_arms(const CarriedRows& rows, const Vec3& change, double from_s,
               ContactProblem& problem) {
  for (std::uint32_t i = rows.first; i < rows.first + rows.points; ++i) {
    NormalRow& normal = problem.normals[i];
    RowContact& contact = problem.contacts[i];
    const Vec3 arm = change.cross(normal.normal);
    const double displacement_m = from_s * problem.bodies[rows.kinematic].angular.dot(arm);
    (rows.is_a ? normal.arm_a : normal.arm_b) += arm;
    contact.carried_m += rows.is_a ? displacement_m : -displacement_m;
    if (contact.friction_row < 0) continue;
    FrictionRow& friction = problem.frictions[contact.friction_row];
    (rows.is_a ? friction.arm_a : friction.arm_b) += change;
  }
}

}  // namespace

void keep_carried(const SceneDescription& scene, const ContactManifold& manifold, std::uint32_t a,
                  std::uint32_t b, const IndexedSpan<BodyState>& states, ContactProblem& problem) {
  const bool is_a = is_kinematic(scene, manifold.a);
  if (is_static(manifold.b) || !(is_a || is_kinematic(scene, manifold.b))) return;
  const std::uint32_t kinematic = is_a ? a : b, other = is_a ? b : a;
  if (states[kinematic].angular_velocity_rad_s == Vec3::Zero()) return;
  CarriedRows rows;
  rows.kinematic = kinematic;
  rows.is_a = is_a;
  rows.first = static_cast<std::uint32_t>(problem.normals.size());
  rows.points = manifold.count;
  rows.arm_m = states[other].position_m - states[kinematic].position_m;
  problem.carried.push_back(rows);
}

void carry(double from_s, double length_s, ContactProblem& problem) {
  if (!(length_s > 0.0)) return;
  for (CarriedRows& rows : problem.carried) {
    const Vec3& angular_velocity = problem.bodies[rows.kinematic].angular;
    const Vec3 now = turned_by(angular_velocity * from_s, rows.arm_m);
    const Vec3 change_m = now + mean_turned(angular_velocity, length_s, now) - rows.arm_m;
    move_arms(rows, change_m - rows.change_m, from_s, problem);
    rows.change_m = change_m;
  }
}

}  // namespace soda::physics
