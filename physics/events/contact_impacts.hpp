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

// Advances an island in which something comes near for a hit, or turns so far that it may, from hit
// to hit. A hit is a point that approaches faster than the restitution threshold where its pair
// bounces; if the scene asks for a tolerance, or something of the island is sent on (sent_on.hpp),
// also one that approaches faster than gravity makes things in two steps, whatever bounces. Up to a
// hit bodies are advanced as if there were none (advance_resting): points on their way to one have
// no part in that. What contacts hold together is advanced together, and nothing else is: contacts
// that hold nothing (advance_apart.hpp) count as none as long as they keep their gaps. At a hit
// velocities change as resolve_impact() has it: all points nearer than 1e-4 of a width of a pair
// that touches, and of what is that near above statics, at once, from the hit on as far as what
// touches reaches; what rests on statics or does not bounce is held, what bounces but is not hit
// itself is let go and hit next. So faces hit as faces, and bodies that touch in a row pass a
// momentum on. What a body can meet is looked for on the path that it is on, and again when a hit
// changes that.
//
// Nothing, and nothing changed, if there is neither, or the island is not of this kind: joints,
// masses that differ by more than ten thousand times, a body that turns by more than 18 radians, or
// more work for the hits that are known to come than a step has
// (contact_impact_run.cpp): contacts that hold many bodies together are advanced with all of them
// for each. Nor if moving surfaces would give, impact by impact, more than the bounds in `scratch`
// (displacement_bounds.hpp). Where that work is done, what is left is one step. The manifolds were
// found at these states, except where worlds that speculate know different ones: what comes of that
// never counts. The report's estimate is the largest of a body's over its parts. A function of the
// arguments only.
std::optional<ContactImpactStep> advance_with_contact_impacts(const IslandStep& step,
                                                              std::span<BodyState> states,
                                                              const IslandEffects& effects);

}  // namespace soda::physics
