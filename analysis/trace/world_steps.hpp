// What each world did for each step of a run, as far as its log tells.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>

#include "analysis/event_log/log_reader.hpp"
#include "scenarios/scenario.hpp"

namespace soda::analysis {

// Of the step from the state after `step` steps to the next.
struct WorldStep {
  // Of a trace. Clocks are the executor's: the machine's from the run's begin, or the virtual one.
  struct Work {
    std::size_t executed = 0;     // executions of events, with those that are absorbed
    std::size_t rolled_back = 0;  // of these, in the end
    std::size_t committed = 0;
    std::size_t absorbed = 0;       // late messages that changed nothing
    std::size_t late = 0;           // messages that came late, with these
    std::size_t rollbacks = 0;      // back to this step
    std::int64_t began_ns = 0;      // the first execution
    std::int64_t finished_ns = 0;   // the last one
    std::int64_t executing_ns = 0;  // all together
    std::int64_t wasted_ns = 0;     // of what was rolled back in the end
    std::optional<std::int64_t> committed_ns;
    // When the step was finished for the last time: steps beyond GVT as its worker knew it, and
    // finished steps that were not committed, this one too, as the transform buffer holds them.
    std::optional<std::int64_t> lead, entries;
  };
  // Of a state, with which the step begins.
  struct Bodies {
    std::size_t bodies = 0;    // whose centre is in its territory
    std::size_t islands = 0;   // whose first body is one of these
    std::size_t contacts = 0;  // contact points that bear something and whose lower id is one
  };
  std::int64_t step = 0;
  std::uint32_t world = 0;
  std::optional<Work> work;      // nothing: the log has no trace
  std::optional<Bodies> bodies;  // nothing: it has no state of this step
};

// By step, then world. Throws UsageError if the log has neither trace nor states, FileError as
// read_records() and follow_changes().
void read_world_steps(LogReader& log, const scenarios::Scenario& scenario,
                      const std::function<void(const WorldStep&)>& on_step);

}  // namespace soda::analysis
