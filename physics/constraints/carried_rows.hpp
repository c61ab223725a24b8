// Contacts with kinematic bodies that turn: what rides on these goes along chords of its circle.
//
// Velocities are constant in a step, a surface's as of its start would lead what sticks to it along
// the tangent: outwards, by (w dt)^2 r / 2 a step. So the kinematic body's arm to a contact is
// d + (p - c), with c the centre of the other body and d the mean, over the time that is solved
// for, of what the arm from the kinematic body's centre to c turns to. That is what c is carried
// by. The arm of a body of infinite mass is in no effective mass, so it may change within a step.
#pragma once

#include <span>

#include "physics/constraints/contact_rows.hpp"

namespace soda::physics {

// The manifold's rows come next in `problem`. Nothing is kept unless one of the two is kinematic
// and turns.
void keep_carried(const SceneDescription& scene, const ContactManifold& manifold, std::uint32_t a,
                  std::uint32_t b, const IndexedSpan<BodyState>& states, ContactProblem& problem);

// Arms for the time from `from_s` of the step on, for `length_s`. Gaps stay those of the arms that
// there were since the step's start.
void carry(double from_s, double length_s, ContactProblem& problem);

}  // namespace soda::physics
