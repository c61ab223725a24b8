#include "physics/events/contact_impacts.hpp"

#include <algorithm>
#include <limits>
#include <vector>

#include "physics/constraints/displacement_bounds.hpp"
#include "physics/events/contact_impact_run.hpp"
#include "physics/events/meeting_pairs.hpp"
#include "physics/forces/forces.hpp"
#include "physics/integrators/advance_once.hpp"
#include "physics/model/kinematic.hpp"
#include "physics/shapes/geometry_impl.hpp"
#include "physics/solvers/direct_contacts.hpp"
#include "physics/solvers/island_motion.hpp"

namespace soda::physics {
namespace {

// Iterations, which solve what bounces, do not get anywhere with a grain between a block that is
// that much heavier and the floor: it rotates fast, and is thrown. Without rebounds it is held. And
// what rotates so fast that no number of parts would show where it hits is not looked at.
bool can_be_hit(const ContactImpactIsland& island, std::span<const BodyState> states) {
  constexpr double kMostRatio = 1e4;
  constexpr double kMostRotation_rad = 18.0;
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (!is_unjointed(island.scene.bodies[index_of(island.ids[i])], states[i])) return false;
    if (shape_of(island.scene, island.geometry, island.ids[i]).kind == ShapeKind::kSphere) continue;
    if (states[i].angular_velocity_rad_s.norm() * island.dt_s > kMostRotation_rad) return false;
  }
  return mass_ratio(island.scene, island.ids) <= kMostRatio;
}

}  // namespace

Need contact_impacts_needed(const SceneDescription& scene) {
  const Need contacts = contacts_needed(scene);
  if (!contacts) return contacts;
  if (!can_meet(bodies_that(scene, can_be_unjointed), scene.statics.size()))
    return {false, "joints hold the bodies that can touch"};
  if (scene.tolerance > 0.0) return {true, "contacts are resolved to a tolerance"};
  const auto springy = [](const auto& body) { return body.material.restitution > 0.0; };
  const bool bounces =
      statics_that(scene, springy) > 0 || bodies_that(scene, [&](const BodyParams& body) {
                                            return can_be_unjointed(body) && springy(body);
                                          }) > 0;
  if (!bounces && bodies_that(scene, can_be_unjointed) > 1)
    return {true, "hits can send bodies on to others"};
  return need_of(bounces, "a material has restitution > 0",
                 "nothing without joints has restitution > 0");
}

std::optional<ContactImpactStep> advance_with_contact_impacts(const IslandStep& step,
                                                              std::span<BodyState> states,
                                                              const IslandEffects& effects) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = step;
  const ContactImpactIsland island(step);
  if (any_kinematic(scene, ids)) return {};
  if (std::min(clear_s(island, manifolds, states), foreseen_s(island, manifolds, states)) >= dt_s)
    return {};
  if (!can_be_hit(island, states)) return {};
  // Measures know what pushes give in a step from its start on; parts start elsewhere.
  const Vec3 known_newton_s = push_impulses_newton_s(scene, dt_s, ids, states);
  const std::vector<BodyState> before(states.begin(), states.end());
  const std::size_t faults_before = effects.faults.size();
  ContactImpactStep result;
  for (const bool apart : {true, false}) {
    result.report = report_of(ids, manifolds);
    result.report.static_impulse_newton_s = -known_newton_s;
    ContactImpactRun hits(island, apart, states, result.report, effects);
    if (!hits.is_affordable()) {
      ++effects.counters.islands_over_budget;
      return {};
    }
    result.hit = hits.run();
    const bool overdriven = is_overdriven(scene, ids, states, effects.scratch.displacement_bounds);
    if (!overdriven && (!apart || hits.stayed_apart())) break;
    std::copy(before.begin(), before.end(), states.begin());
    effects.faults.resize(faults_before);
    if (overdriven) return {};
  }
  if (scene.tolerance > 0.0 && result.report.error_estimate > scene.tolerance)
    result.report.beyond_tolerance = true;
  return result;
}

}  // namespace soda::physics
