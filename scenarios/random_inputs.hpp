// User input drawn from a seed, to try a scene with.
#pragma once

#include <cstdint>

#include "scenarios/scenario.hpp"

namespace soda::scenarios {

// Adds inputs of all kinds, for bodies and steps drawn from the seed, to those of the scenario; ids
// follow the greatest that is there. About one for every second body, at least 8, at most 200.
// Pushes and velocities of up to 2 m/s; bodies are added within two of the territory's cells of
// where they start.
void add_random_inputs(std::uint64_t seed, Scenario& scenario);

}  // namespace soda::scenarios
