// Friction that turns round: where something slides the other way after a part of a step.
#pragma once

#include <optional>
#include <span>

#include "physics/model/contact_manifold.hpp"
#include "physics/refinement/step_doubling.hpp"

namespace soda::physics {

// Friction pulls against the velocity that a step ends with. A part in which a contact point comes
// to slide the other way thus has friction turned too early: trials of any number of steps agree in
// that if it turns within the first of them, and no estimate sees it.
//
// What that can leave: of all pressed points with friction that slid one way at `from` and slide
// the other way at `to`, the lesser of the two speeds; of those that stop, the speed at `from`, for
// what stops may have to slide back. `start` are the contacts at `from`.
StepError reversal_error(const RefinedIsland& island, std::span<const ContactManifold> start,
                         std::span<const BodyState> from, std::span<const BodyState> to);

// When the first of the points with more of that error than the budget allows turns round or stops,
// as a share of time_s, if forces stay as they are in the first thousandth of it (one step more).
// None if that is not within the time, at its beginning, or so near its end that it makes no
// difference.
std::optional<double> share_before_reversal(RefinedIsland& island, double time_s,
                                            std::span<const ContactManifold> start,
                                            std::span<const BodyState> from,
                                            std::span<const BodyState> to);

}  // namespace soda::physics
