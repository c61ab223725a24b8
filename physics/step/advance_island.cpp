#include "physics/step/advance_island.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "physics/constraints/joint_loads.hpp"
#include "physics/events/contact_impacts.hpp"
#include "physics/events/event_driven_impacts.hpp"
#include "physics/events/floor_stops.hpp"
#include "physics/events/impacting_contacts.hpp"
#include "physics/events/linked_step.hpp"
#include "physics/events/one_solve.hpp"
#include "physics/events/sleeping.hpp"
#include "physics/integrators/advance_once.hpp"
#include "physics/integrators/joint_motion.hpp"
#include "physics/integrators/momentum.hpp"
#include "physics/math/carried.hpp"
#include "physics/model/kinematic.hpp"
#include "physics/refinement/advance_resting.hpp"
#include "physics/refinement/refinement.hpp"
#include "physics/refinement/step_doubling.hpp"
#include "physics/solvers/island_motion.hpp"

namespace soda::physics {
namespace {

// Detection only: contacts are reported, bodies move as if they touched nothing.
void pass_through(const IslandStep& island, std::span<BodyState> states, IslandReport& report,
                  const IslandEffects& effects) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  for (const ContactManifold& m : manifolds)
    report.max_penetration_m = std::max(report.max_penetration_m, -least_separation_m(m));
  for (std::size_t i = 0; i < ids.size(); ++i) {
    advance_free_body(scene, dt_s, ids[i], states[i], effects.counters, effects.faults);
    effects.counters.kinematic_bodies += scene.bodies[index_of(ids[i])].kinematic;
  }
}

// Contacts do not tell: bodies that hit each other may come to statics within the step.
bool has_met_no_static(const IslandReport& report) {
  return report.static_impulse_newton_s == Vec3::Zero() &&
         report.static_angular_impulse_newton_m_s == Vec3::Zero();
}

// Those of kinematic bodies, in the order of `ids`.
std::vector<BodyState> carried_on(const SceneDescription& scene, std::span<const BodyId> ids,
                                  std::span<const BodyState> states) {
  std::vector<BodyState> after;
  for (std::size_t i = 0; i < ids.size(); ++i)
    if (is_kinematic(scene, ids[i])) after.push_back(carried(scene, ids[i], states[i], scene.dt_s));
  return after;
}

// What solvers have made of their motion has rounding in it. Impulses stay.
void set_carried(const SceneDescription& scene, std::span<const BodyId> ids,
                 std::span<BodyState> after, std::span<BodyState> states, StageCounters& counters) {
  std::size_t next = 0;
  for (std::size_t i = 0; i < ids.size() && next < after.size(); ++i) {
    if (!is_kinematic(scene, ids[i])) continue;
    BodyState& state = after[next++];
    state.impulses = std::move(states[i].impulses);
    states[i] = std::move(state);
    ++counters.kinematic_bodies;
  }
}

// The rest of a step of which the island has flown `flown_s`.
void advance_rest(const IslandStep& island, double flown_s, std::span<BodyState> states,
                  IslandReport& report, const IslandEffects& effects) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  StageCounters& counters = effects.counters;
  const bool whole = !is_large(manifolds);
  const double rest_s = dt_s - flown_s;
  std::vector<BodyState> start;
  if (whole && !scene.statics.empty()) {
    start.reserve(states.size());
    for (const BodyState& state : states) start.push_back(motion_of(state));
  }
  std::vector<ContactManifold> left;
  // Impacts have brought bodies to others, and to statics, than those that the step began with.
  if (flown_s > 0.0) find_all_again(island.over(rest_s, manifolds), states, counters, left);
  const IslandStep rest = island.over(rest_s, flown_s > 0.0 ? left : manifolds);
  const bool linked = whole && is_linked(rest.manifolds);
  // What flight has left has been through its impacts, unless it is sent on to others, or spins:
  // then other features come round.
  const bool through = flown_s > 0.0 && std::ranges::none_of(manifolds, is_link) &&
                       foreseen_s(ContactImpactIsland(rest), rest.manifolds, states) >= rest_s;
  std::optional<ContactImpactStep> among;
  if (whole && !linked && !through) among = advance_with_contact_impacts(rest, states, effects);
  const IslandReport part = among    ? among->report
                            : linked ? advance_linked(rest, states, effects)
                                     : advance_resting(rest, states, effects);
  if (flown_s > 0.0)
    add_part(part, report);
  else
    report = part;
  if (start.empty()) return;
  stop_at_floors(rest, start, states, report);
}

}  // namespace

IslandReport advance_island(const IslandStep& island, std::span<BodyState> states,
                            const IslandEffects& effects) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  const auto& [scratch, counters, faults] = effects;
  IslandReport report = report_of(ids, manifolds);
  if (!scene.solver.contact_response) {
    pass_through(island, states, report, effects);
    return report;
  }
  // Large ones may be solved by several worlds, of which none has them all.
  std::vector<BodyState> after = carried_on(scene, ids, states);
  const bool whole = !is_large(manifolds),
             alone = whole && after.empty() && is_isolated_system(scene, ids, manifolds, states);
  const IslandMomentum before = alone ? momentum_of(scene, ids, states) : IslandMomentum{};
  std::vector<BodyState> slow;
  if (may_fall_asleep(island, states)) {
    if (is_in_static_equilibrium(island, states, report, counters)) {
      ++counters.islands_at_rest;
      break_joints(scene, ids, states, report, counters);
      return report;
    }
    slow.assign(states.begin(), states.end());
  }
  if (!scene.joints.empty()) report_lost_joints(scene, ids, manifolds, states, faults);
  bound_displacements(scene, dt_s, ids, manifolds, states, scratch.displacement_bounds);
  double flown_s = 0.0;
  if (!whole && is_one_solve(island, states)) {
    counters.islands_over_budget += gains_by_refinement(island, states);
    report = advance_once(island, Exactness::kOngoing, states, effects);
  } else {
    flown_s = fly_through_impacts(island, states, report, counters);
    if (flown_s < dt_s) advance_rest(island, flown_s, states, report, effects);
  }
  if (flown_s < dt_s && alone && has_met_no_static(report)) {
    keep_momentum(scene, dt_s, ids, before, states);
    if (before.one_field) report.push_out_work_joule = 0.0;
  }
  for (std::size_t i = 0; i < ids.size(); ++i)
    report_impossible_displacement(scene, scratch.displacement_bounds, i, ids[i], states[i],
                                   faults);
  if (!slow.empty() && (whole || report.direct || is_linked(manifolds)))
    fall_asleep(island, slow, states, report);
  set_carried(scene, ids, after, states, counters);
  break_joints(scene, ids, states, report, counters);
  ++counters.islands_solved;
  counters.direct_islands += report.direct;
  return report;
}

}  // namespace soda::physics
