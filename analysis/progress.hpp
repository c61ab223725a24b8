// A line of progress on a terminal.
#pragma once

#include <cstdint>
#include <functional>

#include "models/simulation.hpp"

namespace soda::analysis {

// Rewrites one line of stderr, at most five times a second: committed step, rate, efficiency, time
// left. Empty (so that nothing is called) if `quiet` or stderr is no terminal. The line is erased
// when the last copy of the function is destroyed.
std::function<void(const models::Progress&)> terminal_progress(std::int64_t steps, bool quiet);

}  // namespace soda::analysis
