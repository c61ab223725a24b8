// A complete scenario from a seed, as a user would write it.
#pragma once

#include <cstdint>

#include "analysis/whole/scene_parts.hpp"

namespace soda::analysis {

// A function of the seed. 1 to 300 bodies, as many scenes of 1 to 10 as of 10 to 100; one to three
// idioms, on floors, slabs and meshes, with materials of restitution 0 to 1, steps of 1/240 to
// 1/20 s, user input, all settings of the solver, and a territory of 1 to 64 worlds whose borders
// and corners run through bodies. `steps` is as many as one would look at: 20 to 400.
WholeScene draw_whole_scene(std::uint64_t seed);

}  // namespace soda::analysis
