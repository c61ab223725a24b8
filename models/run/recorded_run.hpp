// A traced run again, in the order in which it was executed.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "kernel/api/executor.hpp"
#include "models/commit/commit.hpp"
#include "models/options/run_options.hpp"

namespace soda::models {

// Drives `worlds` as `options.recorded` has it; what came from outside are the inputs of the
// script, and the transfers that balancing decided. Where it is not whole, `observer` hears where
// the worlds stand then.
kernel::RunResult run_recorded(std::span<const std::unique_ptr<kernel::LogicalProcess>> worlds,
                               const RunOptions& options, const kernel::Recording& recording,
                               const CommitObserver& observer);

// Those of `changes` that hold from `step` on, for they are in order of steps.
std::vector<TerritoryChange> changes_at(std::span<const TerritoryChange> changes,
                                        std::int64_t step);

}  // namespace soda::models
