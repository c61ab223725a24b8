// Extrapolation of ghosts that have not come yet, from what the step before knew of foreign bodies.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "models/messages/messages.hpp"
#include "models/options/run_options.hpp"
#include "models/user_input/rules.hpp"
#include "physics/model/stage_counters.hpp"
#include "physics/shapes/geometry.hpp"

namespace soda::models {

// The ghosts of a step, and who has sent some, if only an empty message; the others are
// extrapolated.
struct ReceivedGhosts {
  std::vector<WorldId> from;  // ascending
  std::vector<Ghost> ghosts;  // ascending by (owner, id)
};

// What a step leaves for extrapolation in the next one; part of the buffer entry. Empty if ghosts
// are not extrapolated. An extrapolation needs an answer: whom a world tells of a body in a step,
// or sends one to, is told something in the next one, too, if only that there is nothing. So both
// know of it.
struct ForeignView {
  std::vector<WorldId> ghosts_sent_to;  // ascending: worlds that this one has sent a ghost
  std::vector<WorldId> bodies_sent_to;  // ascending: that have got a body from it
  ReceivedGhosts received;
  // Foreign bodies whose state is known at the step's end: those that left this world, and those
  // that it solved together with its own. At most one of each id.
  std::vector<Node> known;

  // Whether the next step sees no difference: it does not ask who has sent. Who takes an
  // entry for another one has to compare this, too.
  friend bool operator==(const ForeignView& a, const ForeignView& b);
};

// Who will send ghosts in the next step. Ascending.
std::vector<WorldId> news_from(const ForeignView& view);

// Where `worlds`, a sorted list, has not got `world`: puts it in.
void add_world(WorldId world, std::vector<WorldId>& worlds);

// A world, and who has told it of a step, ascending.
struct ToldWorld {
  WorldId self;
  std::span<const WorldId> told_by;
};

// What the worlds of news_from(before) that have not told world `told.self` of this step will tell
// it, as far as `before` tells. Ascending by (owner, id). `rules` are those of the step.
//   kDeadReckoning: a body goes on with constant velocity and spin.
//   kPredicted: it goes on as a body that touches nothing, by the very function that its owner
//     calls; or, if it has stored contact impulses, something carries it: with constant velocity.
//     Where nothing has touched it the extrapolation has the bits of what will come.
// A body whose state is known is taken as it is: in kDeadReckoning only one that has left it.
// A function of the arguments; `mode` is not kReceivedOnly.
std::vector<Ghost> extrapolate_ghosts(GhostMode mode, const Rules& rules,
                                      const physics::Geometry& geometry, const ToldWorld& told,
                                      const ForeignView& before, physics::StageCounters& counters);

// Ascending by id, for the use of a world with such own bodies. While a body is on its way between
// owners it can be there twice, or be own already: the lowest owner's ghost stays, and no own body.
std::vector<Ghost> foreign_ghosts(std::vector<Ghost> ghosts,
                                  const std::function<bool(physics::BodyId)>& is_own);

// Bodies whose ghosts are not the same in both, bit for bit. All ascending.
std::vector<physics::BodyId> differing(std::span<const Ghost> a, std::span<const Ghost> b);

}  // namespace soda::models
