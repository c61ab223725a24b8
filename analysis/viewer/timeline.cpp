#include "analysis/viewer/timeline.hpp"

#include <algorithm>
#include <map>
#include <numeric>
#include <set>

#include "analysis/trace/execution_trace.hpp"
#include "analysis/trace/why_command.hpp"
#include "analysis/viewer/timeline_bars.hpp"
#include "kernel/api/external_source.hpp"
#include "models/messages/schedule.hpp"

namespace soda::analysis {
namespace {

constexpr std::size_t kMostSamples = 600, kLeastSamples = 100, kSampledWorlds = 150'000;
constexpr std::int64_t kMostCosts = 1'000;
constexpr std::size_t kMostCommits = 4'000;
constexpr std::size_t kMostNamedBodies = 24, kMostArrows = 6;

// The rollbacks that a page holds, by time: all, or those that cost most.
std::vector<RollbackNumber> costliest(const ExecutionTrace& trace, std::size_t most) {
  std::vector<RollbackNumber> numbers(trace.rollbacks.size());
  std::iota(numbers.begin(), numbers.end(), RollbackNumber{0});
  if (numbers.size() <= most) return numbers;
  std::vector<std::int64_t> wasted;
  wasted.reserve(numbers.size());
  for (const RollbackNumber number : numbers) wasted.push_back(trace.wasted_ns(number));
  std::ranges::stable_sort(numbers, std::ranges::greater(),
                           [&wasted](RollbackNumber number) { return wasted[number]; });
  numbers.resize(most);
  std::ranges::sort(numbers);
  return numbers;
}

Timeline::Arrow arrow_of(const ExecutionTrace& trace, const LateMessage& message) {
  Timeline::Arrow arrow;
  const bool external = message.from == kernel::index_of(kernel::kExternalSource);
  arrow.from = external ? Timeline::kNobody : message.from;
  arrow.arrived_ns = arrow.sent_ns = message.arrived_ns;
  arrow.sent_at = virtual_steps(message.time);
  arrow.anti = message.anti;
  if (message.sent_by) {
    const TracedExecution& sender = trace.executions[*message.sent_by];
    arrow.sent_ns = sender.began_ns + sender.took_ns;
    arrow.sent_at = virtual_steps(sender.time);
  } else if (message.sent_in) {
    arrow.sent_ns = trace.rollbacks[*message.sent_in].at_ns;
    arrow.sent_at = virtual_steps(trace.rollbacks[*message.sent_in].changed);
  }
  arrow.sent_ns = std::min(arrow.sent_ns, arrow.arrived_ns);
  return arrow;
}

// Those that the reason names come first.
std::vector<std::uint32_t> bodies_of(const ExecutionTrace& trace, const TracedRollback& rollback,
                                     std::size_t bodies) {
  std::vector<std::uint32_t> found;
  const auto add = [&found, bodies](std::uint64_t id) {
    const auto body = static_cast<std::uint32_t>(id);
    if (id < bodies && found.size() < kMostNamedBodies &&
        std::ranges::find(found, body) == found.end())
      found.push_back(body);
  };
  if (rollback.refusal.code != 0) {
    add(rollback.refusal.subject);
    add(rollback.refusal.other);
  }
  for (const std::size_t late : rollback.late)
    for (const std::uint32_t body : trace.late[late].bodies) add(body);
  return found;
}

void add_rollbacks(const ExecutionTrace& trace, const std::vector<std::uint32_t>& labels,
                   const std::vector<RollbackNumber>& kept, Timeline& timeline) {
  std::map<std::string, std::uint32_t> causes;
  const std::vector<RollbackNumber> told = costliest(trace, kMostTexts);
  for (const RollbackNumber number : kept) {
    const TracedRollback& rollback = trace.rollbacks[number];
    Timeline::Rollback& shown = timeline.rollbacks.emplace_back();
    shown.number = static_cast<std::uint32_t>(number) + 1;
    shown.world = rollback.world;
    shown.at_ns = rollback.at_ns;
    shown.restart = rollback.restart.t;
    shown.changed_step = rollback.changed.t;
    shown.changed_at = virtual_steps(rollback.changed);
    shown.undone = static_cast<std::uint32_t>(rollback.undone.size());
    shown.put_back = static_cast<std::uint32_t>(rollback.put_back);
    shown.wasted_ns = trace.wasted_ns(number);
    if (const auto before = trace.led_to(number)) shown.because_of = place_of(kept, *before);
    const auto size = static_cast<std::uint32_t>(causes.size());
    shown.cause = causes.emplace(cause_of(trace, number), size).first->second;
    shown.bodies = bodies_of(trace, rollback, labels.size());
    for (const std::size_t late : rollback.late)
      if (shown.arrows.size() < kMostArrows)
        shown.arrows.push_back(arrow_of(trace, trace.late[late]));
    if (std::ranges::binary_search(told, number)) shown.text = why_text(trace, number, labels);
  }
  timeline.causes.resize(causes.size());
  for (const auto& [name, place] : causes) timeline.causes[place] = name;
}

// What cannot be had of executions alone.
struct Passage {
  struct Level {
    std::int64_t at_ns = 0, step = 0;
  };
  std::vector<std::vector<Level>> levels;          // that worlds came to, by world
  std::map<std::int64_t, std::int64_t> committed;  // when the last event of a step was
  std::vector<Level> gvt;                          // by time: how many steps lie before it
};

Passage passage_of(LogReader& log, std::uint32_t worlds) {
  Passage passage;
  passage.levels.resize(worlds);
  read_records(log, worlds, [&passage](std::uint32_t, const kernel::TraceRecord& record) {
    using kernel::Happening;
    if (record.what == Happening::kCommitted) {
      std::int64_t& at = passage.committed[record.time.t];
      at = std::max(at, record.clock_ns);
    }
    if (record.what == Happening::kGvt && record.time != kernel::kNever)
      passage.gvt.push_back({record.clock_ns, models::steps_before(record.time)});
    if (record.what == Happening::kExecuted || record.what == Happening::kRewound ||
        record.what == Happening::kJumped)
      passage.levels[kernel::index_of(record.lp)].push_back({record.clock_ns, record.time.t});
  });
  for (std::vector<Passage::Level>& levels : passage.levels)
    std::ranges::stable_sort(levels, {}, &Passage::Level::at_ns);
  std::ranges::stable_sort(passage.gvt, {}, &Passage::Level::at_ns);
  return passage;
}

// As soon as GVT has passed a step, or where there is none, as its last event is committed.
void add_commits(const Passage& passage, const LogReader& log, Timeline& timeline) {
  const std::int64_t last = log.last_step();
  std::vector<Timeline::Commit> all = {{log.first_step(), 0}};
  const auto add = [&](std::int64_t steps, std::int64_t at_ns) {
    if (steps > all.back().steps && steps <= last)
      all.push_back({steps, std::max(at_ns, all.back().at_ns)});
  };
  for (const Passage::Level& gvt : passage.gvt) add(gvt.step, gvt.at_ns);
  for (const auto& [step, at_ns] : passage.committed)
    if (step < last) add(step + 1, at_ns);
  const std::size_t every = (all.size() + kMostCommits - 1) / kMostCommits;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (i % every == 0 || i + 1 == all.size()) timeline.commits.push_back(all[i]);
}

void add_samples(const ExecutionTrace& trace, const Passage& passage, Timeline& timeline) {
  const std::size_t count = std::clamp(kSampledWorlds / std::max<std::size_t>(1, trace.worlds),
                                       kLeastSamples, kMostSamples);
  timeline.samples.resize(count);
  const double window_ns =
      std::max(1.0, static_cast<double>(timeline.end_ns)) / static_cast<double>(count);
  const auto sample_of = [&](std::int64_t at_ns) -> Timeline::Sample& {
    const double place = static_cast<double>(at_ns) / window_ns;
    return timeline.samples[std::clamp<std::size_t>(static_cast<std::size_t>(std::max(0.0, place)),
                                                    0, count - 1)];
  };
  for (const TracedExecution& execution : trace.executions) {
    if (execution.absorbed) continue;
    Timeline::Sample& sample = sample_of(execution.began_ns);
    ++sample.executed;
    if (execution.undone_by) ++sample.undone;
  }
  auto commit = timeline.commits.begin();
  std::vector<std::size_t> passed(passage.levels.size());
  std::vector<std::int64_t> reached(passage.levels.size());
  for (std::size_t i = 0; i < count; ++i) {
    const auto until = static_cast<std::int64_t>(window_ns * static_cast<double>(i + 1));
    while (commit + 1 != timeline.commits.end() && (commit + 1)->at_ns <= until) ++commit;
    for (std::size_t world = 0; world < reached.size(); ++world) {
      const std::vector<Passage::Level>& levels = passage.levels[world];
      for (; passed[world] < levels.size() && levels[passed[world]].at_ns <= until; ++passed[world])
        reached[world] = levels[passed[world]].step;
    }
    timeline.samples[i].committed = commit->steps;
    timeline.samples[i].reached = reached;
  }
}

void add_costs(const ExecutionTrace& trace, const LogReader& log, Timeline& timeline) {
  const std::int64_t steps = log.last_step() - log.first_step();
  timeline.steps_a_cost = std::max<std::int64_t>(1, (steps + kMostCosts - 1) / kMostCosts);
  timeline.costs.resize(
      static_cast<std::size_t>((steps + timeline.steps_a_cost - 1) / timeline.steps_a_cost));
  for (const TracedExecution& execution : trace.executions) {
    const std::int64_t step = execution.time.t;
    if (step < log.first_step() || step >= log.last_step()) continue;
    Timeline::StepCost& cost =
        timeline.costs[static_cast<std::size_t>((step - log.first_step()) / timeline.steps_a_cost)];
    (execution.undone_by ? cost.in_vain_ns : cost.kept_ns) += execution.took_ns;
  }
}

std::int64_t end_of(const ExecutionTrace& trace, const Passage& passage) {
  std::int64_t end = 1;
  for (const TracedExecution& execution : trace.executions)
    end = std::max(end, execution.began_ns + execution.took_ns);
  for (const auto& [step, at_ns] : passage.committed) end = std::max(end, at_ns);
  return end;
}

}  // namespace

double virtual_steps(kernel::VirtualTime time) {
  return static_cast<double>(time.t) + static_cast<double>(models::phase_of(time)) / 8.0;
}

std::uint32_t place_of(const std::vector<std::size_t>& kept, std::size_t number) {
  const auto found = std::ranges::lower_bound(kept, number);
  return found == kept.end() || *found != number ? Timeline::kNobody
                                                 : static_cast<std::uint32_t>(found - kept.begin());
}

std::optional<Timeline> timeline_of(LogReader& log, const scenarios::Scenario& scenario) {
  if (log.options().level != LogLevel::kTrace) return std::nullopt;
  const std::uint32_t worlds = scenario.territory.worlds;
  const ExecutionTrace trace = read_trace(log, worlds);
  const Passage passage = passage_of(log, worlds);
  const std::vector<RollbackNumber> kept = costliest(trace, kMostRollbacks);
  Timeline timeline;
  timeline.worlds = worlds;
  timeline.buffer = scenario.run.buffer;
  timeline.is_modelled = scenario.run.executor == models::ExecutorKind::kVirtual;
  timeline.all_executions = trace.executions.size();
  timeline.all_rollbacks = trace.rollbacks.size();
  timeline.end_ns = end_of(trace, passage);
  add_bars(trace, kept, timeline);
  add_rollbacks(trace, log.labels(), kept, timeline);
  add_commits(passage, log, timeline);
  add_samples(trace, passage, timeline);
  add_costs(trace, log, timeline);
  return timeline;
}

}  // namespace soda::analysis
