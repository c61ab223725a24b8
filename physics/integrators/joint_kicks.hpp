// External forces in two halves: what hangs and swings moves by the mean of its velocities.
//
// A step gives external forces whole before it moves the bodies, and so moves them too far by half
// of what the forces give (symplectic Euler). Of a body in free fall parabolas make up for that, of
// articulated islands RATTLE. What swings from a body that is touched lost m (g dt)^2 / 2 a step.
// Joints that meet these forces pull half with the directions at the start, half with those at the
// end: both together are velocity Verlet.
#pragma once

#include <span>
#include <vector>

#include "physics/constraints/joint_rows.hpp"
#include "physics/integrators/joint_motion.hpp"
#include "physics/math/solver_body.hpp"
#include "physics/model/body_state.hpp"

namespace soda::physics {

// Rows in the middle of the step that ask for no velocity. Limits and motors are idle.
JointSystem middle_rows(const JointedStep& step, const JointedSolution& solved);

// What external forces give, as far as joints let it pass.
struct JointKicks {
  // Bodies with these velocities. What contacts or springs carry has none, and holds the joints.
  std::vector<SolverBody> bodies;
  JointSystem joints;       // with the impulses by which they meet the forces
  double lift_joule = 0.0;  // by which moving half of that less lifts the bodies
};

// Limits and motors that carry hold as well. Bodies resist by the joints' geometric stiffness too
// (joint_stiffness.hpp), as in a step twice as long: what is taut and swings faster than the step
// is damped, solutions that have not quite converged included. Nothing, without bodies, where all
// of them are held so, or where nothing holds the island to the world.
JointKicks find_kicks(const JointedStep& step, const JointedSolution& solved,
                      const JointSystem& middle);

// Moves the bodies back by half of the kicks, and joins what that opens: by a share that lifts by
// no more than `most_joule`, and lets nothing touch that did not. `states` are those at the end;
// velocities stay. Not at all where joints cannot be closed so.
void move_by_mean(const JointedStep& step, const JointedSolution& solved, const JointKicks& kicks,
                  double most_joule, std::span<BodyState> states);

}  // namespace soda::physics
