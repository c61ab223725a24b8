// Comparing a replayed step with the logged one.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "analysis/event_log/log_format.hpp"

namespace soda::analysis {

// Why `logged` and the replayed states are not the same, in one line that names step, body, field
// and both values, or says that the log contradicts itself; empty if all agree bit for bit.
std::string divergence(const LoggedStep& logged, std::span<const physics::BodyId> ids,
                       std::span<const physics::BodyState> replayed,
                       std::span<const std::uint32_t> labels);

}  // namespace soda::analysis
