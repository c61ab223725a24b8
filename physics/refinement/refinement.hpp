// Islands that are advanced in several steps, as many as change what counts.
#pragma once

#include <span>

#include "physics/model/body_state.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/island_report.hpp"
#include "physics/model/island_step.hpp"
#include "physics/model/need.hpp"

namespace soda::physics {

Need refinement_needed(const SceneDescription& scene);

// Of a step: what is that short is off by less than what refinement is content with unasked.
inline constexpr double kShort = 0.01;

// Whether refinement leads an island nearer: nothing in it is pushed apart, and the scene asks for
// a tolerance, or no joint other than springs holds it. A function of the arguments only, and not
// of the time.
bool gains_by_refinement(const IslandStep& island, std::span<const BodyState> states);

// Whether that stays within the budget of work that a step has unasked: large islands are beyond
// it, take a plain step, of first order, and are counted (islands_over_budget).
bool is_affordable(const SceneDescription& scene, std::span<const ContactManifold> manifolds);

// Advances such an island. Where velocities stay as they are this is one step of
// advance_once. Else it takes one and two of them, and four unless forces are steady, and
// extrapolates what they tell to steps of no length (third order), or takes the four where these
// are nearer already (joints have steps of a higher order). Where the error is more than the
// tolerance allows, the time is cut in two, and each part is treated alike. So motion between
// changes (from sliding to sticking, say) is smooth, and a change is closed in upon. Without a
// tolerance that is for a single body; several keep to the plain step unless trials lead much
// nearer to a limit. The manifolds were found at these states. After a limited number of solves,
// cutting ends.
//
// The tolerance is that of the scene for the whole step, with the report's estimate: half of it is
// shared out over time, the other half is for changes. Without one, it is 1e-7 for each part, and
// nothing is estimated; smooth motion for which that is out of reach keeps the limit of four steps,
// and a hit its one step where that is solved and turns the body little.
IslandReport advance_refined(const IslandStep& step, std::span<BodyState> states,
                             const IslandEffects& effects);

// One step of an island that is not refined though the scene asks for a tolerance: all that changed
// in it counts as its error.
IslandReport advance_unrefined(const IslandStep& island, std::span<BodyState> states,
                               const IslandEffects& effects);

}  // namespace soda::physics
