#include "analysis/viewer/timeline_bars.hpp"

#include <algorithm>

#include "models/messages/schedule.hpp"

namespace soda::analysis {
namespace {

using Bar = Timeline::Bar;
using Fate = Timeline::Fate;

Fate bar_fate(const TracedExecution& execution) {
  if (execution.undone_by) return Fate::kRolledBack;
  if (execution.repeats) return Fate::kRepeated;
  if (!execution.committed) return Fate::kOpen;
  return execution.again_for ? Fate::kCommittedAgain : Fate::kCommitted;
}

// Each execution as a bar, by world and time.
std::vector<Bar> single_bars(const ExecutionTrace& trace, const std::vector<RollbackNumber>& kept) {
  std::vector<Bar> bars;
  bars.reserve(trace.executions.size());
  for (const TracedExecution& execution : trace.executions) {
    if (execution.absorbed) continue;  // nothing was executed
    Bar& bar = bars.emplace_back();
    bar.began_ns = execution.began_ns;
    bar.ended_ns = execution.began_ns + execution.took_ns;
    bar.busy_ns = execution.took_ns;
    bar.world = execution.world;
    bar.step = bar.last_step = execution.time.t;
    bar.phase = static_cast<std::uint8_t>(models::phase_of(execution.time));
    bar.fate = bar_fate(execution);
    if (execution.undone_by) bar.rollback = place_of(kept, *execution.undone_by);
  }
  std::ranges::stable_sort(bars, [](const Bar& a, const Bar& b) {
    return a.world != b.world ? a.world < b.world : a.began_ns < b.began_ns;
  });
  return bars;
}

bool belong_together(const Bar& a, const Bar& b, std::int64_t steps) {
  return a.world == b.world && a.fate == b.fate && a.rollback == b.rollback &&
         a.last_step / steps == b.step / steps && a.step / steps == b.step / steps;
}

std::vector<Bar> merged(const std::vector<Bar>& bars, std::int64_t steps) {
  std::vector<Bar> merged;
  for (const Bar& bar : bars) {
    if (merged.empty() || !belong_together(merged.back(), bar, steps)) {
      merged.push_back(bar);
      continue;
    }
    Bar& last = merged.back();
    last.ended_ns = std::max(last.ended_ns, bar.ended_ns);
    last.busy_ns += bar.busy_ns;
    last.step = std::min(last.step, bar.step);
    last.last_step = std::max(last.last_step, bar.last_step);
  }
  return merged;
}

}  // namespace

void add_bars(const ExecutionTrace& trace, const std::vector<RollbackNumber>& kept,
              Timeline& timeline) {
  constexpr std::int64_t kMostSteps = std::int64_t{1} << 40;
  timeline.bars = single_bars(trace, kept);
  for (std::int64_t steps = 1; timeline.bars.size() > kMostBars && steps < kMostSteps; steps *= 2) {
    timeline.bars = merged(timeline.bars, steps);
    timeline.steps_a_bar = steps;
  }
  if (timeline.bars.size() <= kMostBars) return;
  // Bars that alternate cannot be merged: those that were rolled back stay, then the longest.
  std::ranges::stable_sort(timeline.bars, [](const Bar& a, const Bar& b) {
    const bool x = a.fate == Fate::kRolledBack, y = b.fate == Fate::kRolledBack;
    return x != y ? x : a.busy_ns > b.busy_ns;
  });
  timeline.bars.resize(kMostBars);
  std::ranges::stable_sort(timeline.bars, [](const Bar& a, const Bar& b) {
    return a.world != b.world ? a.world < b.world : a.began_ns < b.began_ns;
  });
}

}  // namespace soda::analysis
