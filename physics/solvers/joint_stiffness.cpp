#include "physics/solvers/joint_stiffness.hpp"

#include <cmath>
#include <vector>

#include "physics/math/rigid_motion.hpp"
#include "physics/solvers/convex_contacts.hpp"

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

}  // namespace

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

}  // namespace soda::physics
