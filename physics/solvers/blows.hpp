// Blows within a step in substeps: what comes to something that does not bounce. Iterations share a
// blow out over what touches as far as they get, and what they leave flies apart; here it is
// shared out until every contact law is fulfilled.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/constraints/contact_rows.hpp"
#include "physics/model/need.hpp"

namespace soda::physics {

struct Substeps;

// Of islands of three bodies or more.
Need blows_needed(const SceneDescription& scene);

// Rows of one step, ascending.
struct Blows {
  std::vector<std::uint32_t> may_close;  // that bore nothing in the step before, or move
  // By the warm start: they open as soon as they bear what they bore in the step before. That was a
  // blow.
  std::vector<std::uint32_t> overestimated;
  double most_multiplications = 0.0;  // that they are worth
};

// What blows took: how many were shared out, how many left to the iterations, and multiplications
// of factorisations, roughly.
struct BlowWork {
  std::uint32_t shared = 0, left = 0;
  std::uint64_t multiplications = 0;
  double most_multiplications = 0.0;  // in this step
  int factorisations = 0;
  double hardest_m_s = 0.0;  // the fastest closing
  bool gave_up = false;      // did not converge, or the step's factorisations are used up
};

// `problem` as build_rows leaves it. None without the direct solver.
Blows find_blows(const SolveStep& step, const ContactProblem& problem);

// After begin_substeps(): what closes at the step's start is a blow, and rows that are
// overestimated get anew what they bear in the first substep. `free`: velocities after external
// forces.
void start_with_blow(const Blows& blows, std::span<const SolverBody> free, ContactProblem& problem,
                     Substeps& substeps, BlowWork& work);

// Before relax(): where a point closes in the substep that comes, and to stop it takes more than
// what it bears, the velocities of all that touches, from body to body, become at once what
// fulfils the contact laws: by Newton's method, to 1e-4 of the blow at least. Budget of work: 12
// factorisations a blow and two for each of its bodies (6 where rows are overestimated and nothing
// closes, and none if those are more than 6 bodies with faces on each other), 128 a step; 2e5
// multiplications a step and 7000 for each pair of the island in touch, 1e4 and 1000 if the scene
// is not to be refined; and none where a factorisation costs far more than the iterations. Beyond
// it, and where Newton's method does not converge, the blow is left to the iterations of the
// substeps. The impulses of a blow are in the substeps' sums alone, so that the next substep does
// not expect them again.
void share_blow(const Blows& blows, ContactProblem& problem, Substeps& substeps, BlowWork& work);

}  // namespace soda::physics
