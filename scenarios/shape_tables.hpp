// Tables of shapes and orientations, which several objects of the format contain.
#pragma once

#include "scenarios/field_table.hpp"

namespace soda::scenarios {

extern const ChoiceTable kSolidShape, kStaticShape, kOrientation;

}  // namespace soda::scenarios
