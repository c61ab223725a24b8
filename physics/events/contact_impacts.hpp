// Islands in which something rests, rolls or slides, and something is hit: the hits one after the
// other, each when it happens.
#pragma once

#include <optional>
#include <span>

#include "physics/model/body_state.hpp"
#include "physics/model/island_report.hpp"
#include "physics/model/island_step.hpp"
#include "physics/model/need.hpp"

namespace soda::physics {

// Of such hits.
Need contact_impacts_needed(const SceneDescription& scene);

struct ContactImpactStep {
  IslandReport report;
  bool hit = false;  // in this time
};

// Advances an island from hit to hit, if something in it comes near for a hit or turns so far that
// it may. A hit is a point that approaches faster than the restitution threshold, if its pair
// bounces. If the scene asks for a tolerance, or something of the island is sent on (sent_on.hpp),
// a point that approaches faster than gravity makes things in two steps is a hit as well, whatever
// bounces.
//
// Between hits, bodies are advanced as if there were none (advance_resting): points on their way to
// a hit have no part in that. Bodies that contacts hold together are advanced together, all others
// by themselves. Contacts that hold nothing (advance_apart.hpp) count as none as long as they keep
// their gaps. What a body can meet is looked for on the path that it is on, and again when a hit
// changes that.
//
// At a hit, velocities change as resolve_impact() has it, at once for all that touches, from body
// to body. Two bodies touch within 1e-9 of their width, a body and a static within 1e-4; of a pair
// that touches, all points within 1e-4 take part. What rests on statics or does not bounce is held.
// What bounces but is not hit itself is let go, and is hit next. So faces hit as faces, and bodies
// that touch in a row pass a momentum on.
//
// Returns nothing, and changes nothing, in these cases:
// - nothing comes near for a hit, and nothing turns so far;
// - the island has joints, masses that differ by more than ten thousand times, or a body that turns
//   by more than 18 radians;
// - the hits that are known to come are more work than a step has (contact_impact_run.cpp). For
//   each, contacts that hold many bodies together are advanced with all of them;
// - moving surfaces would give, impact by impact, more than the bounds in `scratch`
//   (displacement_bounds.hpp).
// If the work is used up on the way, what is left of the step is advanced at once. The manifolds
// were found at these states, except where worlds that speculate know different ones: what comes of
// that never counts. The report's estimate is the largest of a body's over its parts. A function of
// the arguments only.
std::optional<ContactImpactStep> advance_with_contact_impacts(const IslandStep& step,
                                                              std::span<BodyState> states,
                                                              const IslandEffects& effects);

}  // namespace soda::physics
