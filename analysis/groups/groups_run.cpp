#include "analysis/groups/groups_run.hpp"

#include <algorithm>

#include "analysis/event_log/logged_run.hpp"
#include "analysis/runs/measured_run.hpp"
#include "analysis/trace/execution_trace.hpp"
#include "kernel/api/external_source.hpp"
#include "physics/step/step.hpp"

namespace soda::analysis {
namespace {

StepGroups step_groups(std::int64_t step, const SyncGroups& groups, std::uint32_t worlds) {
  return {step, groups.shares(), groups.sizes()[0] / static_cast<double>(worlds)};
}

// What one step looks like to all worlds together.
struct StepView {
  const physics::SceneDescription& scene;
  const physics::Geometry& geometry;
  const models::TerritoryMap& map;
  const LoggedStep& start;
  std::vector<models::WorldId> owners;
};

SyncGroups groups_by_overlap(const StepView& view, physics::StepScratch& scratch) {
  physics::StageCounters uncounted;
  SyncGroups groups(view.map.worlds());
  physics::compute_boxes(view.scene, view.geometry, view.start.ids, view.start.states,
                         scratch.boxes, uncounted);
  bond_by_overlap(scratch.boxes, view.owners, view.map, groups);
  return groups;
}

SyncGroups groups_by_contact(const StepView& view, physics::StepScratch& scratch) {
  physics::StageCounters uncounted;
  SyncGroups groups(view.map.worlds());
  physics::find_contacts_alone(view.scene, view.geometry, view.start.ids, view.start.states,
                               scratch, uncounted);
  bond_by_contact(scratch.manifolds, view.start.ids, view.owners, groups);
  return groups;
}

BondOverTime groups_by_rollbacks(LogReader& log, std::uint32_t worlds) {
  std::vector<SyncGroups> steps(static_cast<std::size_t>(log.last_step()), SyncGroups(worlds));
  const ExecutionTrace trace = read_trace(log, worlds);
  for (const TracedRollback& rollback : trace.rollbacks) {
    const std::int64_t step = rollback.changed.t;
    if (step < 0 || step >= log.last_step()) continue;
    for (const std::size_t number : rollback.late) {
      const LateMessage& late = trace.late[number];
      if (late.from == kernel::index_of(kernel::kExternalSource)) continue;
      steps[static_cast<std::size_t>(step)].bond(models::WorldId{late.from},
                                                 models::WorldId{rollback.world});
    }
  }
  BondOverTime result{GroupBond::kRollbacks, {}};
  for (const SyncGroups& groups : steps)
    result.steps.push_back(
        step_groups(static_cast<std::int64_t>(result.steps.size()), groups, worlds));
  return result;
}

}  // namespace

std::vector<BondOverTime> groups_of_run(LogReader& log, const scenarios::Scenario& scenario,
                                        const std::vector<GroupBond>& bonds) {
  const physics::Geometry geometry(scenario.scene);
  models::TerritoryMap map =
      models::make_territory_map(scenario.territory, centres(scenario.initial), &scenario.scene);
  std::vector<BondOverTime> result;
  result.reserve(bonds.size());
  for (const GroupBond bond : bonds) {
    result.push_back(bond == GroupBond::kRollbacks ? groups_by_rollbacks(log, map.worlds())
                                                   : BondOverTime{bond, {}});
  }
  physics::StepScratch scratch;
  LoggedStep start = log.read_states(0);
  for (std::int64_t step = 0; step < log.last_step(); ++step) {
    LoggedStep after = log.read_states(step + 1);
    follow_changes(after, map);
    StepView view{scenario.scene, geometry, map, start, {}};
    for (const physics::BodyState& state : start.states)
      view.owners.push_back(map.owner_at(state.position_m));
    for (BondOverTime& bond : result) {
      if (bond.bond == GroupBond::kRollbacks) continue;
      const SyncGroups groups = bond.bond == GroupBond::kOverlap ? groups_by_overlap(view, scratch)
                                                                 : groups_by_contact(view, scratch);
      bond.steps.push_back(step_groups(step, groups, map.worlds()));
    }
    start = std::move(after);
  }
  return result;
}

StepGroups mean_of_steps(const BondOverTime& bond, std::size_t first, std::size_t end) {
  StepGroups mean{bond.steps[first].step, {}, 0.0};
  const auto count = static_cast<double>(end - first);
  for (std::size_t i = first; i < end; ++i) {
    for (std::size_t k = 0; k < kGroupClasses; ++k)
      mean.shares[k] += bond.steps[i].shares[k] / count;
    mean.largest += bond.steps[i].largest / count;
  }
  return mean;
}

}  // namespace soda::analysis
