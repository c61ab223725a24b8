// Executions as bars, merged until there are few enough.
#pragma once

#include <cstdint>
#include <vector>

#include "analysis/trace/execution_trace.hpp"
#include "analysis/viewer/timeline.hpp"

namespace soda::analysis {

// Virtual time in steps, with phases as eighths.
double virtual_steps(kernel::VirtualTime time);
// Of `number` in `kept`, which ascends; kNobody if it is not there.
std::uint32_t place_of(const std::vector<std::size_t>& kept, std::size_t number);

// Fills in bars and steps_a_bar. Bars that were rolled back name those of `kept`.
void add_bars(const ExecutionTrace& trace, const std::vector<RollbackNumber>& kept,
              Timeline& timeline);

}  // namespace soda::analysis
