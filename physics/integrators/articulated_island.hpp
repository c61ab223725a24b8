// Islands that joints hold and nothing touches.
// Sources: RATTLE is that of H. C. Andersen, "Rattle: a velocity version of the Shake algorithm for
// molecular dynamics calculations", J. Comput. Phys. 52, 1983. With c(x) = 0 what the joints hold
// and J = dc/dx, a step solves for impulses l and m:
//   v' = v + (dt/2) M^-1 f(x) + M^-1 J(x)^T l,    x' = x + dt v',   c(x') = 0
//   v'' = v' + (dt/2) M^-1 f(x') + M^-1 J(x')^T m,                  J(x') v'' = 0
// Five steps of lengths a, a, 1 - 4 a, a, a with a = 1 / (4 - 4^(1/3)) make the fourth order:
// M. Suzuki, "Fractal decomposition of exponential operators with applications to many-body
// theories and Monte Carlo simulations", Phys. Lett. A 146, 1990. Deviation: bodies drift by their
// free rotation (rigid_motion.hpp) instead of along straight lines.
#pragma once

#include <span>
#include <vector>

#include "physics/constraints/joint_rows.hpp"
#include "physics/model/island_report.hpp"
#include "physics/model/island_step.hpp"

namespace soda::physics {

// Advances an island that joints hold and nothing touches. All but springs hold at both ends of the
// step, in place and in velocity (RATTLE with the free rotation of each body, symmetric in time:
// second order with limits, motors, drives or damping, else five of them for the fourth). Springs
// act on the bodies by impulses (springs.hpp). `report` has its label; to its impulse by statics is
// added what damping and drives gave beyond what drive_impulse (measures.hpp) tells of the start,
// as velocities that the joints change are damped. False, and no change, if that does not work out
// because the joints are nearly contradictory, or with springs that are too stiff or not of the
// fourth order: then they have to be solved as beside contacts.
bool advance_articulated(const IslandStep& island, JointSystem& joints, std::span<BodyState> states,
                         IslandReport& report, std::vector<AdvanceFault>& faults);

// The same to the time's share of the scene's tolerance, in parts of second order, as few as an
// estimate of their error allows: the report has it. It is taken from how much the kicks at both
// ends of a part differ, and from what was taken for energy. False, and no change, where that would
// take many parts, and for joints with springs, limits or motors, and bodies with drives or forces
// of their own.
bool advance_articulated_to_tolerance(const IslandStep& island, JointSystem& joints,
                                      std::span<BodyState> states, IslandReport& report,
                                      std::vector<AdvanceFault>& faults);

}  // namespace soda::physics
