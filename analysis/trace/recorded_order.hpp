// A traced run to be had again as it was executed: the order in a log, and whether it came out so.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "analysis/event_log/log_reader.hpp"
#include "analysis/trace/recorded_walk.hpp"
#include "kernel/executors/recorded_executor.hpp"
#include "models/commit/commit.hpp"
#include "models/options/run_options.hpp"
#include "scenarios/scenario.hpp"

namespace soda::analysis {

// How the logged run was executed, to be had again so. `scenario`: the logged one, which is made to
// run as far as it was asked to. Throws UsageError if there is no trace, or the run ended early or
// was in sequence: that has no order of its own.
models::RecordedExecution recorded_execution(LogReader& log, scenarios::Scenario& scenario);

// Where the worlds stood after the first `number` happenings of `walk`, with what was speculative
// then: so far the run is had again as it was executed. Throws kernel::NotAsRecorded, and
// UsageError if a world has executed what came from outside and its log does not hold.
std::vector<models::WorldStand> stands_as_executed(LogReader& log, scenarios::Scenario scenario,
                                                   const RecordedWalk& walk, std::size_t number);

// Where what a world did, in `chunks` of its run again, is first not what the log tells: world,
// number of the happening, and both (trace_comparison.hpp).
std::optional<std::string> trace_divergence(LogReader& log, std::uint32_t worlds,
                                            std::span<const kernel::Bytes> chunks);

}  // namespace soda::analysis
