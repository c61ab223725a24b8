#include "physics/integrators/explicit_springs.hpp"

#include <algorithm>
#include <cmath>

#include "physics/constraints/springs.hpp"
#include "physics/integrators/joint_motion.hpp"
#include "physics/math/solver_body.hpp"
#include "physics/model/contact_manifold.hpp"

namespace soda::physics {
namespace {

// Of the parts in which springs that nothing touches are followed: trials of two and four times as
// many parts lead to their limit.
constexpr double kOfParts = 0.5;
constexpr double kMostExplicitParts = 8.0;

double parts_of(const SceneDescription& scene, double time_s, std::span<const BodyId> ids,
                const JointSystem& springs, std::span<const BodyState> states) {
  const std::vector<SolverBody> bodies = bodies_at(scene, ids, states);
  return kOfParts * parts_for(rates_of(spring_rows(scene, states, springs), bodies), time_s);
}

bool are_springs_in_contact(const SceneDescription& scene,
                            std::span<const ContactManifold> manifolds) {
  bool springs = false, contact = false;
  for (const ContactManifold& m : manifolds) {
    contact = contact || m.count > 0;
    if (!is_joint(m)) continue;
    if (scene.joints[joint_of(m)].kind != JointKind::kSpring) return false;
    springs = true;
  }
  return springs && contact;
}

}  // namespace

JointSystem find_explicit_springs(const IslandStep& island, std::span<const BodyState> states) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  if (scene.joints.empty() || !are_springs_in_contact(scene, manifolds)) return {};
  JointSystem springs = find_joints(scene, ids, manifolds);
  if (!(parts_of(scene, dt_s, ids, springs, states) <= kMostExplicitParts)) return {};
  return springs;
}

int parts_of_explicit_springs(const SceneDescription& scene, double time_s,
                              std::span<const BodyId> ids, const JointSystem& springs,
                              std::span<const BodyState> states) {
  const double parts = parts_of(scene, time_s, ids, springs, states);
  return parts < 2.0 * kMostExplicitParts ? 1 + static_cast<int>(parts)
                                          : static_cast<int>(kMostExplicitParts);
}

void apply_explicit_springs(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                            const JointSystem& springs, std::span<BodyState> states,
                            IslandReport& report) {
  std::vector<SolverBody> bodies = bodies_at(scene, ids, states);
  apply_spring_impulses(spring_rows(scene, states, springs), dt_s, false, states, bodies, report);
  for (std::size_t i = 0; i < states.size(); ++i) {
    states[i].linear_velocity_m_s = bodies[i].linear;
    states[i].angular_velocity_rad_s = bodies[i].angular;
  }
}

std::vector<double> most_changed_by_springs_m_s(const SceneDescription& scene, double time_s,
                                                std::span<const BodyId> ids,
                                                const JointSystem& springs, const BodySizes& sizes,
                                                std::span<const BodyState> states) {
  const std::vector<SolverBody> bodies = bodies_at(scene, ids, states);
  std::vector<double> most(ids.size(), 0.0);
  for (const SpringRow& spring : spring_rows(scene, states, springs)) {
    const JointRow& row = spring.row;
    const double speed = std::abs(velocity_of(row, bodies));
    const double push =
        time_s * (spring.stiffness_newton_m * (std::abs(row.error) + time_s * speed) +
                  spring.damping_newton_s_m * speed);
    const auto add = [&](std::uint32_t body, const Vec3& angular) {
      if (body == ids.size()) return;
      most[body] +=
          push * (bodies[body].inverse_mass +
                  sizes.bodies[body].radius_m * (bodies[body].inverse_inertia * angular).norm());
    };
    add(row.a, row.angular_a);
    add(row.b, row.angular_b);
  }
  return most;
}

}  // namespace soda::physics
