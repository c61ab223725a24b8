// Contacts as they are at the end of a step, for solving it anew.
//
// A solve holds the points that touch at the start for the whole step, to first order. A solid that
// turns shows others meanwhile (a coin that rolls on its rim, an edge that comes down), and these
// sink in. So the contacts of the predicted end are taken back along the motion, and the step is
// solved with them: Newton's method on the gaps of the end, one step an iteration.
#pragma once

#include <span>
#include <vector>

#include "physics/constraints/contact_rows.hpp"
#include "physics/model/body_state.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/island_step.hpp"
#include "physics/model/need.hpp"

namespace soda::physics {

Need end_contacts_needed(const SceneDescription& scene);

// Whether a turn of these bodies brings other points of theirs into touch: not of balls, nor beside
// kinematic bodies, whose rows follow their turn.
bool shows_other_points(const SceneDescription& scene, std::span<const BodyId> ids);

// States of an island's bodies before and after a solve, and what corrected positions besides the
// velocities of `end` (empty: nothing).
struct IslandMove {
  std::span<const BodyState> start, end;
  std::span<const PositionCorrection> push;
};

// Whether a body, by its place, has turned far enough for that; whether any of them has.
bool turns_far(const IslandStep& island, const IslandMove& move, std::size_t body);
bool can_come_round(const IslandStep& island, const IslandMove& move);

// `contacts`: those that were solved; becomes the contacts of the island's pairs at the end, each
// point with the gap that it had at the start if all moved by the velocities of the end throughout,
// and where it was then. Points that were solved stay among them, and pairs that are not near any
// more keep all. Returns by how much the overlap of a pair has grown at most since the start of the
// step, in sizes of its smaller body.
double find_end_contacts(const IslandStep& island, const IslandMove& move, StageCounters& counters,
                         std::vector<ContactManifold>& contacts);

// Growth up to which a step is left as it is.
inline constexpr double kMostGrowth = 4e-3;

// The most solves after the first: three, and of islands of many points one.
int most_end_solves(std::size_t points);

}  // namespace soda::physics
