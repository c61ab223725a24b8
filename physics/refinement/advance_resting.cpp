#include "physics/refinement/advance_resting.hpp"

#include <algorithm>

#include "physics/constraints/springs.hpp"
#include "physics/integrators/advance_once.hpp"
#include "physics/integrators/joint_motion.hpp"
#include "physics/integrators/linkage.hpp"
#include "physics/measures/refinement_error.hpp"
#include "physics/refinement/advance_apart.hpp"
#include "physics/refinement/refinement.hpp"
#include "physics/solvers/island_motion.hpp"

namespace soda::physics {
namespace {

// One spring, if its motion has a closed form: no step to refine.
bool advance_exactly(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                     std::span<const ContactManifold> manifolds, std::span<BodyState> states,
                     IslandReport& report, StageCounters& counters,
                     std::vector<AdvanceFault>& faults) {
  if (manifolds.size() != 1 || !is_joint(manifolds.front()) ||
      scene.joints[joint_of(manifolds.front())].kind != JointKind::kSpring)
    return false;
  const JointSystem joints = find_joints(scene, ids, manifolds);
  report = report_of(ids, manifolds);
  if (!advance_lone_spring(scene, dt_s, joints, states, report, faults)) return false;
  ++counters.joint_rows;
  return true;
}

// To the scene's tolerance, if joints alone hold the island, are closed, and few parts are enough.
bool advance_within_tolerance(const SceneDescription& scene, const Geometry& geometry, double dt_s,
                              std::span<const BodyId> ids,
                              std::span<const ContactManifold> manifolds,
                              std::span<BodyState> states, IslandReport& report,
                              StageCounters& counters, std::vector<AdvanceFault>& faults) {
  if (!(scene.tolerance > 0.0) || scene.joints.empty()) return false;
  for (const ContactManifold& m : manifolds)
    if (!is_joint(m)) return false;
  JointSystem joints = find_joints(scene, ids, manifolds);
  if (joints.empty() || !are_closed(scene, dt_s, states, joints)) return false;
  report = report_of(ids, manifolds);
  if (!advance_linkage_within(scene.tolerance * (dt_s / scene.dt_s), sizes_of(scene, geometry, ids),
                              scene, dt_s, ids, joints, states, report, faults))
    return false;
  count_linked(scene, ids, joints, report, counters);
  return true;
}

// One set of bodies that nothing divides.
IslandReport advance_together(const SceneDescription& scene, const Geometry& geometry, double dt_s,
                              std::span<const BodyId> ids,
                              std::span<const ContactManifold> manifolds,
                              std::span<BodyState> states, SolveScratch& scratch,
                              StageCounters& counters, std::vector<AdvanceFault>& faults) {
  const bool affordable = is_affordable(scene, manifolds);
  const bool gains = gains_by_refinement(scene, geometry, ids, manifolds, states);
  counters.islands_over_budget += gains && !affordable;
  const auto advance = gains && affordable ? advance_refined : advance_unrefined;
  return advance(scene, geometry, dt_s, ids, manifolds, states, scratch, counters, faults);
}

// Islands that nothing holds together, each for itself. False, and nothing changed, if they do not
// stay apart, or something goes wrong.
bool advance_apart(const SceneDescription& scene, const Geometry& geometry, double dt_s,
                   std::span<const BodyId> ids, std::span<const ContactManifold> manifolds,
                   std::span<BodyState> states, IslandReport& report, SolveScratch& scratch,
                   StageCounters& counters) {
  std::vector<ContactManifold> kept;
  const Islands islands = islands_apart(scene, geometry, dt_s, ids, manifolds, states, kept);
  if (islands.count() + islands.free_bodies.size() < 2) return false;
  report = report_of(ids, manifolds);
  std::vector<BodyState> after(states.begin(), states.end());
  std::vector<AdvanceFault> faults;
  for (const std::uint32_t body : islands.free_bodies)
    advance_free_body(scene, dt_s, ids[body], after[body], counters, faults);
  for (std::size_t i = 0; i < islands.count(); ++i) {
    std::vector<BodyId> own_ids;
    std::vector<BodyState> own;
    std::vector<ContactManifold> contacts;
    const auto begin = islands.bodies.begin();
    const std::vector<std::uint32_t> bodies(begin + islands.body_begin[i],
                                            begin + islands.body_begin[i + 1]);
    for (const std::uint32_t body : bodies) {
      own_ids.push_back(ids[body]);
      own.push_back(std::move(after[body]));
    }
    for (std::uint32_t m = islands.manifold_begin[i]; m < islands.manifold_begin[i + 1]; ++m)
      contacts.push_back(kept[islands.manifolds[m]]);
    add_part(
        advance_together(scene, geometry, dt_s, own_ids, contacts, own, scratch, counters, faults),
        report);
    for (std::size_t j = 0; j < bodies.size(); ++j) after[bodies[j]] = std::move(own[j]);
  }
  if (!faults.empty() || !stayed_apart(scene, geometry, ids, manifolds, islands, states, after))
    return false;
  std::move(after.begin(), after.end(), states.begin());
  return true;
}

}  // namespace

IslandReport advance_resting(const SceneDescription& scene, const Geometry& geometry, double dt_s,
                             std::span<const BodyId> ids,
                             std::span<const ContactManifold> manifolds,
                             std::span<BodyState> states, SolveScratch& scratch,
                             StageCounters& counters, std::vector<AdvanceFault>& faults) {
  IslandReport report;
  if (advance_exactly(scene, dt_s, ids, manifolds, states, report, counters, faults)) return report;
  if (advance_within_tolerance(scene, geometry, dt_s, ids, manifolds, states, report, counters,
                               faults))
    return report;
  if (advance_apart(scene, geometry, dt_s, ids, manifolds, states, report, scratch, counters))
    return report;
  return advance_together(scene, geometry, dt_s, ids, manifolds, states, scratch, counters, faults);
}

}  // namespace soda::physics
