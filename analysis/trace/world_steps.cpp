#include "analysis/trace/world_steps.hpp"

#include <algorithm>
#include <vector>

#include "analysis/event_log/logged_run.hpp"
#include "analysis/runs/measured_run.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/trace/execution_trace.hpp"
#include "models/messages/schedule.hpp"

namespace soda::analysis {
namespace {

using kernel::Happening;
using kernel::TraceRecord;
using kernel::VirtualTime;

// The work of all worlds for the steps of a log.
class WorkTable {
 public:
  WorkTable(const LogReader& log, std::uint32_t worlds)
      : first_(log.first_step()),
        worlds_(worlds),
        cells_(static_cast<std::size_t>(log.last_step() - first_) * worlds) {}

  const WorldStep::Work& at(std::int64_t step, std::uint32_t world) const {
    return cells_[static_cast<std::size_t>(step - first_) * worlds_ + world];
  }

  void add(const ExecutionTrace& trace) {
    for (const TracedExecution& execution : trace.executions) add_execution(execution);
    for (const LateMessage& message : trace.late)
      if (WorldStep::Work* const work = find(message.time.t, message.to)) {
        ++work->late;
        work->absorbed += message.absorbed;
      }
    for (const TracedRollback& rollback : trace.rollbacks)
      if (WorldStep::Work* const work = find(rollback.changed.t, rollback.world)) ++work->rollbacks;
  }

  // Records of one worker in their order; each world belongs to one.
  void add(std::uint32_t worker, const TraceRecord& record) {
    if (worker != worker_) gvt_ = kernel::kBeginning;
    worker_ = worker;
    if (record.what == Happening::kGvt) gvt_ = record.time;
    const bool is_step =
        record.what == Happening::kExecuted || record.what == Happening::kCommitted;
    if (!is_step || models::phase_of(record.time) != models::Phase::kFinish) return;
    const std::uint32_t world = kernel::index_of(record.lp);
    WorldStep::Work* const work = find(record.time.t, world);
    if (work == nullptr) return;
    if (record.what == Happening::kCommitted) {
      committed_.resize(worlds_, first_);
      committed_[world] = record.time.t + 1;
      work->committed_ns = record.clock_ns;
      return;
    }
    committed_.resize(worlds_, first_);
    work->lead = std::max<std::int64_t>(0, record.time.t - std::max(gvt_.t, first_));
    work->entries = record.time.t + 1 - committed_[world];
  }

 private:
  // Null: of a step that the log has not.
  WorldStep::Work* find(std::int64_t step, std::uint32_t world) {
    if (step < first_ || world >= worlds_) return nullptr;
    const std::size_t place = static_cast<std::size_t>(step - first_) * worlds_ + world;
    return place < cells_.size() ? &cells_[place] : nullptr;
  }

  void add_execution(const TracedExecution& execution) {
    WorldStep::Work* const work = find(execution.time.t, execution.world);
    if (work == nullptr) return;
    const std::int64_t end_ns = execution.began_ns + execution.took_ns;
    if (work->executed == 0 || execution.began_ns < work->began_ns)
      work->began_ns = execution.began_ns;
    work->finished_ns = work->executed == 0 ? end_ns : std::max(work->finished_ns, end_ns);
    ++work->executed;
    work->rolled_back += execution.undone_by.has_value();
    work->committed += execution.committed;
    work->executing_ns += execution.took_ns;
    if (execution.undone_by) work->wasted_ns += execution.took_ns;
  }

  const std::int64_t first_;
  const std::uint32_t worlds_;
  std::vector<WorldStep::Work> cells_;
  std::vector<std::int64_t> committed_;  // steps of each world
  std::uint32_t worker_ = 0;
  VirtualTime gvt_ = kernel::kBeginning;
};

std::vector<WorldStep::Bodies> bodies_of_worlds(const LoggedStep& logged,
                                                const scenarios::Scenario& scenario,
                                                const models::TerritoryMap& map) {
  std::vector<WorldStep::Bodies> worlds(map.worlds());
  const std::vector<std::uint32_t> islands = islands_of(logged, scenario.scene);
  for (std::size_t i = 0; i < logged.ids.size(); ++i) {
    const physics::BodyState& state = logged.states[i];
    WorldStep::Bodies& world = worlds[models::index_of(map.owner_at(state.position_m))];
    ++world.bodies;
    world.islands += islands[i] == i;
    world.contacts += static_cast<std::size_t>(
        std::ranges::count_if(state.impulses, [](const physics::ContactImpulse& impulse) {
          return impulse.part < physics::kFirstJointPart;
        }));
  }
  return worlds;
}

}  // namespace

void read_world_steps(LogReader& log, const scenarios::Scenario& scenario,
                      const std::function<void(const WorldStep&)>& on_step) {
  const bool is_traced = log.options().level == LogLevel::kTrace;
  if (!is_traced) log.last_states();  // there are some
  models::TerritoryMap map =
      models::make_territory_map(scenario.territory, centres(scenario.initial), &scenario.scene);
  const std::uint32_t worlds = map.worlds();
  WorkTable table(log, worlds);
  if (is_traced) {
    table.add(read_trace(log, worlds));
    read_records(log, worlds, [&table](std::uint32_t worker, const TraceRecord& record) {
      table.add(worker, record);
    });
  }
  for (std::int64_t step = log.first_step(); step < log.last_step(); ++step) {
    const LoggedStep logged = log.read_step(step);
    follow_changes(logged, map);
    std::vector<WorldStep::Bodies> bodies;
    if (logged.has_states) {
      require_numbers(log, logged);
      bodies = bodies_of_worlds(logged, scenario, map);
    }
    for (std::uint32_t world = 0; world < worlds; ++world) {
      WorldStep row{step, world, {}, {}};
      if (is_traced) row.work = table.at(step, world);
      if (logged.has_states) row.bodies = bodies[world];
      on_step(row);
    }
  }
}

}  // namespace soda::analysis
