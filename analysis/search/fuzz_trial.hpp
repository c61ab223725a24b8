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

// Runs all steps of the scenario, which has no drives, moving surfaces or inputs. Throws
// CheckFailed with step and body if a fault is recorded, a number is none, or a rule is broken:
//
// energy    In a step, the kinetic and potential energy of an island or a free body rises by no
//           more than the work that its island reports and a rounding. Reported work is that of
//           motors, and that of displacements without velocity. The latter counts no further than
//           position correction at its greatest speed explains (displacement_bounds.hpp). The
//           rounding is 1e-9 of the energies before and after and of what gravity moves in a step.
//           It also has the energy of a small speed: the rounding of the fastest speed, times the
//           island's contact points. With springs the rule is for all bodies together, from the
//           start on: they have gained at most 1e-6 of the most energy that they had in a step.
// escape    The centre of a body sinks into a halfspace by no more than the body's radius. Bodies
//           with joints may, once an overlap of their island has been that deep: nothing says then
//           where out is. And no point of a body exceeds 100 times the sum of three speeds: the
//           largest of any point at the start, what gravity adds in the run, and the greatest of
//           position correction.
// way       A body moves in a step no farther than twice the fastest speed of its island, before
//           or after, gravity and position correction take it. Not checked where joints are, or
//           where impacts were looked for within the step.
// momentum  The momentum of an island without joints changes by gravity and by what statics are
//           reported to give. The rest is at most 1e-7 of its masses at the speed of the fastest
//           point so far.
// work      An island takes no more solver iterations and multiplications than its size explains.
FuzzSums run_fuzz_trial(const scenarios::Scenario& scenario);

}  // namespace soda::analysis
