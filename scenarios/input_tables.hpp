// Tables of user input: in a scenario, and as lines of a stream.
#pragma once

#include "scenarios/field_table.hpp"

namespace soda::scenarios {

// In a line the time may be missing; in a scenario it may not.
extern const ChoiceTable kInput, kInputLine;

}  // namespace soda::scenarios
