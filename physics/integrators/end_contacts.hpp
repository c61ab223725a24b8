// Contacts as they are at the end of a step, for solving it anew.
//
// A solve holds the points that touch at the start for the whole step, to first order. A solid that
// turns shows others meanwhile (a coin that rolls on its rim, an edge that comes down), and what a
// contact throws comes to bodies and statics that it was not on its way to. These sink in. So the
// contacts of the predicted end are taken back along the motion, and the step is solved with them:
// Newton's method on the gaps of the end, one step an iteration.
#pragma once

#include <span>
#include <vector>

#include "physics/constraints/contact_rows.hpp"
#include "physics/model/body_state.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/island_step.hpp"
#include "physics/model/need.hpp"

namespace soda::physics {

// Of what has come round, and of what contacts send on.
Need end_contacts_needed(const SceneDescription& scene);
Need sent_contacts_needed(const SceneDescription& scene);

// Whether a rotation of these bodies brings other points of theirs into touch: not of balls, nor
// beside kinematic bodies, whose rows follow their rotation.
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

// Adds links (manifolds without points) to the statics that bodies have been sent to: contacts are
// looked for along the path that a step begins with, and these bodies have left it by more than the
// margin that contacts are kept for. Returns whether contacts are to be looked for anew: there is a
// link, or a body has been sent to a static that it meets in parts.
bool add_unseen_statics(const IslandStep& island, const IslandMove& move, StageCounters& counters,
                        std::vector<ContactManifold>& contacts);

// Appends the contacts of a pair that has none, found from the start of the step along the paths
// that its bodies went: nothing where one is kinematic. Returns its overlap at the end, >= 0.
// Counts as unseen_searches.
double meet_on_path_m(const IslandStep& island, const IslandMove& move, const ContactManifold& pair,
                      StageCounters& counters, std::vector<ContactManifold>& contacts);

// `contacts`: those that were solved, links among them; becomes what the step is to be solved with
// next. If `round`, a pair has its contacts of the end, each point with the gap that it had at the
// start if all moved by the velocities of the end throughout, and where it was then. A pair without
// contacts at the start has what its bodies meet on their paths, and meshes and compounds get what
// was sent to other parts of them. Points that were solved stay among them, and pairs that are not
// near any more keep all, as do those in which a body is by half its size. Returns by how much the
// overlap of a pair has grown at most since the start of the step, in sizes of its smaller body.
double find_end_contacts(const IslandStep& island, const IslandMove& move, bool round,
                         StageCounters& counters, std::vector<ContactManifold>& contacts);

// The most solves after the first: three, and of islands of many points one.
int most_end_solves(std::size_t points);

}  // namespace soda::physics
