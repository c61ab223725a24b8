// States of bodies as text, for people.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "analysis/event_log/log_format.hpp"
#include "analysis/text/text_table.hpp"

namespace soda::analysis {

// A table of bodies, nine digits each: its columns, and the row of one.
std::vector<Column> state_columns();
std::vector<std::string> state_cells(std::uint32_t label, const physics::BodyState& state);

// All bodies of a step.
std::string states_text(const LoggedStep& logged, const std::vector<std::uint32_t>& labels);
// One body in full: every value exact, with its bits.
std::string state_in_full(const physics::BodyState& state);

// The id of the body that users know by `label`. Throws UsageError, beginning with `where`.
physics::BodyId body_of_label(const std::vector<std::uint32_t>& labels, std::uint32_t label,
                              const std::string& where);

}  // namespace soda::analysis
