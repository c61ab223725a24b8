#include "physics/refinement/advance_resting.hpp"

#include <algorithm>

#include "physics/constraints/springs.hpp"
#include "physics/integrators/advance_once.hpp"
#include "physics/integrators/articulated_island.hpp"
#include "physics/integrators/joint_closing.hpp"
#include "physics/measures/refinement_error.hpp"
#include "physics/model/kinematic.hpp"
#include "physics/refinement/advance_apart.hpp"
#include "physics/refinement/refinement.hpp"
#include "physics/refinement/step_doubling.hpp"
#include "physics/solvers/island_motion.hpp"

namespace soda::physics {
namespace {

// One spring, if its motion has a closed form: no step to refine.
bool advance_exactly(const IslandStep& island, std::span<BodyState> states, IslandReport& report,
                     const IslandEffects& effects) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  if (manifolds.size() != 1 || !is_joint(manifolds.front()) ||
      scene.joints[joint_of(manifolds.front())].kind != JointKind::kSpring)
    return false;
  const JointSystem joints = find_joints(scene, ids, manifolds);
  report = report_of(ids, manifolds);
  if (!advance_single_spring(scene, dt_s, joints, states, report, effects.faults)) return false;
  ++effects.counters.joint_rows;
  return true;
}

// To the scene's tolerance, if joints alone hold the island, are closed, and few parts are enough.
bool advance_within_tolerance(const IslandStep& island, std::span<BodyState> states,
                              IslandReport& report, const IslandEffects& effects) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  if (!(scene.tolerance > 0.0) || scene.joints.empty()) return false;
  for (const ContactManifold& m : manifolds)
    if (!is_joint(m)) return false;
  JointSystem joints = find_joints(scene, ids, manifolds);
  if (joints.empty() || !are_closed(scene, dt_s, states, joints)) return false;
  report = report_of(ids, manifolds);
  if (!advance_articulated_to_tolerance(island, joints, states, report, effects.faults))
    return false;
  count_linked(scene, ids, joints, report, effects.counters);
  return true;
}

// Unasked, several bodies are refined once a step, whatever hits divide it: in the part that is
// longer than all others. A single body costs little.
bool is_worth_refining(const IslandStep& island) {
  if (island.scene.tolerance > 0.0) return true;
  return island.dt_s > (island.ids.size() > 1 ? 0.5 : kShort) * island.scene.dt_s;
}

// By how much the overlap of a pair may grow, of its smaller body: what sinks in by more has
// turned, or been thrown, farther than one step can follow.
constexpr double kTooFar = 0.1;

// Whether two steps are allowed in its place: a drive's law is that of a whole step, and a scene
// may say how far to go.
bool can_be_halved(const IslandStep& island) {
  const SceneDescription& scene = island.scene;
  if (scene.tolerance > 0.0 || !scene.solver.refined) return false;
  if (!(island.dt_s > 0.5 * scene.dt_s) || any_kinematic(scene, island.ids)) return false;
  return std::ranges::none_of(
      island.ids, [&](BodyId id) { return scene.bodies[index_of(id)].drive != kNoDrive; });
}

// Its time in two steps, from the states `now`, if that comes nearer than the one of the report.
void advance_in_halves(const IslandStep& island, std::vector<BodyState>& now,
                       std::span<BodyState> states, IslandReport& report,
                       const IslandEffects& effects) {
  const double half_s = 0.5 * island.dt_s;
  std::vector<AdvanceFault> faults;
  std::vector<ContactManifold> found;
  IslandReport halves;
  for (const bool first : {true, false}) {
    find_all_again(island.over(half_s, island.manifolds), now, effects.counters, found);
    const IslandReport half = advance_unrefined(island.over(half_s, found), now,
                                                {effects.scratch, effects.counters, faults});
    ++effects.counters.refined_steps;
    if (first)
      halves = half;
    else
      add_part(half, halves);
  }
  if (!faults.empty() || !(halves.overlap_growth < report.overlap_growth)) return;
  report = halves;
  std::move(now.begin(), now.end(), states.begin());
}

// One set of bodies that nothing divides.
IslandReport advance_together(const IslandStep& island, std::span<BodyState> states,
                              const IslandEffects& effects) {
  const bool affordable = is_affordable(island.scene, island.manifolds);
  const bool gains = is_worth_refining(island) && gains_by_refinement(island, states);
  effects.counters.islands_over_budget += gains && !affordable;
  const auto advance = gains && affordable ? advance_refined : advance_unrefined;
  if (!can_be_halved(island)) return advance(island, states, effects);
  std::vector<BodyState> start(states.begin(), states.end());
  IslandReport report = advance(island, states, effects);
  if (report.overlap_growth > kTooFar) advance_in_halves(island, start, states, report, effects);
  return report;
}

// Islands that nothing holds together, each for itself. False, and nothing changed, if they do not
// stay apart, or something goes wrong.
bool advance_apart(const IslandStep& island, std::span<BodyState> states, IslandReport& report,
                   SolveScratch& scratch, StageCounters& counters) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  std::vector<ContactManifold> kept;
  const Islands islands = islands_apart(island, states, kept);
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
    add_part(advance_together({scene, geometry, dt_s, own_ids, contacts}, own,
                              {scratch, counters, faults}),
             report);
    for (std::size_t j = 0; j < bodies.size(); ++j) after[bodies[j]] = std::move(own[j]);
  }
  if (!faults.empty() || !stayed_apart(island, islands, {states, after, {}}, counters))
    return false;
  std::move(after.begin(), after.end(), states.begin());
  return true;
}

}  // namespace

IslandReport advance_resting(const IslandStep& island, std::span<BodyState> states,
                             const IslandEffects& effects) {
  IslandReport report;
  if (advance_exactly(island, states, report, effects)) return report;
  if (advance_within_tolerance(island, states, report, effects)) return report;
  if (advance_apart(island, states, report, effects.scratch, effects.counters)) return report;
  return advance_together(island, states, effects);
}

}  // namespace soda::physics
