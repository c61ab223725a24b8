// The exact rotation of a rigid body without torque.
#pragma once

#include "analysis/accuracy/closed_forms.hpp"

namespace soda::analysis {

// Spin by Jacobi's elliptic functions, attitude by integrating the precession of one principal axis
// about the angular momentum (its rate is smooth; the quadrature is exact to rounding). The centre
// of mass moves straight on. Any moments of inertia; long double inside.
// [Landau, Lifshitz: Mechanics, section 37]
MotionAt torque_free(const StartingBody& body);

}  // namespace soda::analysis
