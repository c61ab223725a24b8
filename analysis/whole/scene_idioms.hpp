// What users build: piles, stacks, walls, chains, bridges, cars, dolls, rows, gases, belts.
#pragma once

#include <cstdint>

#include "analysis/whole/scene_draw.hpp"

namespace soda::analysis {

// Adds about `count` bodies (at least 1) around `at_m`, which lies on the floor; some with statics
// or drives of their own.
void add_idiom(SceneDraw& draw, std::uint32_t count, const physics::Vec3& at_m);

// A floor in most scenes: a halfspace, a slab, a mesh in the file or beside it; and some obstacles.
void add_ground(SceneDraw& draw);

// Loose bodies and things that hang, roll or are pushed: the two halves of the idioms.
using Idiom = void (*)(SceneDraw& draw, std::uint32_t count, const physics::Vec3& at_m);
void add_loose_idiom(SceneDraw& draw, std::uint32_t count, const physics::Vec3& at_m);
void add_jointed_idiom(SceneDraw& draw, std::uint32_t count, const physics::Vec3& at_m);

}  // namespace soda::analysis
