// Tables of joints.
#pragma once

#include "scenarios/field_table.hpp"

namespace soda::scenarios {

extern const ChoiceTable kJoint;

}  // namespace soda::scenarios
