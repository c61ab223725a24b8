// Tables of how a scene is run: solver, accuracy, territories, executor, balancing, output.
#pragma once

#include "scenarios/field_table.hpp"

namespace soda::scenarios {

extern const ObjectTable kSolver, kAccuracy, kTerritory, kExecutor, kBalancing, kOutput;

}  // namespace soda::scenarios
