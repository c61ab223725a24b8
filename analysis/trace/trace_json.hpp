// What is found in traces, as JSON: keys as in docs/commands.md.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "analysis/trace/what_if_command.hpp"
#include "analysis/trace/why_command.hpp"

namespace soda::analysis {

std::string why_json(const ExecutionTrace& trace, const std::vector<RollbackNumber>& numbers,
                     const std::vector<WhatIf>& helps, const std::vector<std::uint32_t>& labels);
std::string what_if_json(const WhatIf& what);

}  // namespace soda::analysis
