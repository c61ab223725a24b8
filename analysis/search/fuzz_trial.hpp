// One random scene, run step by step under checks that hold for any scene.
#pragma once

#include <cstdint>

#include "scenarios/scenario.hpp"

namespace soda::analysis {

// What a trial did; a maximum where it says so.
struct FuzzSums {
  std::uint64_t steps = 0, islands = 0, contact_points = 0;
  std::uint64_t most_iterations = 0;       // of an island in a step
  std::uint64_t most_multiplications = 0;  // likewise
  double largest_gain = 0.0;               // of energy, of what is allowed; see below
  double push_out_work_joule = 0.0;        // where it is positive
};

void add(const FuzzSums& more, FuzzSums& sums);

// Runs all steps of the scenario, which has neither drives, springs, moving surfaces nor inputs.
// Throws CheckFailed with step and body, if
// - a fault is recorded, or a number is none;
// - energy: what an island or a free body has, kinetic and potential, rises in a step by more than
//   the work that the island reports for displacements without velocity, as far as position
//   correction at its greatest speed (displacement_bounds.hpp) explains that, and rounding: 1e-9 of
//   its energies before and after and of what gravity moves in a step, and that of a speed no
//   larger than rounding leaves of the fastest one, which grows with the island's contact points;
// - escape: a body's centre sinks into a halfspace by more than its own radius (but what joints
//   hold where something in its island has overlapped by as much: nothing says where out is), or a
//   point of it gets faster than 100 times all that it could come from: the largest speed of any
//   point at the start, what gravity adds in the run, what position correction may reach;
// - way: where no impact was looked for within the step, a body without joints moves by more than
//   twice the speed of the fastest of its island, before or after, gravity and position correction
//   take it;
// - momentum: an island's, without joints, changes by other than gravity and what statics are
//   reported to give, by more than 1e-7 of its masses at the speed of the fastest point so far;
// - work: an island takes more solver iterations or multiplications than its size explains.
FuzzSums run_fuzz_trial(const scenarios::Scenario& scenario);

}  // namespace soda::analysis
