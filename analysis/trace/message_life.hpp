// What became of one message of a traced run.
#pragma once

#include <cstdint>
#include <string>

#include "analysis/trace/recorded_walk.hpp"

namespace soda::analysis {

// A line for each: sent, arrived, late, executed with, replaced or taken back; what lies after the
// first `number` happenings is marked. Throws UsageError if nothing is told of it.
std::string message_life(const RecordedWalk& walk, std::size_t number, std::uint32_t source,
                         std::uint64_t version);

}  // namespace soda::analysis
