#include "physics/refinement/advance_resting.hpp"

#include <algorithm>

#include "physics/integrators/advance_once.hpp"
#include "physics/solvers/island_motion.hpp"
#include "physics/integrators/joint_motion.hpp"
#include "physics/integrators/linkage.hpp"
#include "physics/refinement/refinement.hpp"
#include "physics/measures/refinement_error.hpp"
#include "physics/constraints/springs.hpp"

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
  if (!advance_lone_spring(scene, dt_s, ids, joints, states, report, faults)) return false;
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
  return is_refined(scene, geometry, ids, manifolds)
             ? advance_refined(scene, geometry, dt_s, ids, manifolds, states, scratch, counters,
                               faults)
             : advance_unrefined(scene, geometry, dt_s, ids, manifolds, states, scratch, counters,
                                 faults);
}

}  // namespace soda::physics
