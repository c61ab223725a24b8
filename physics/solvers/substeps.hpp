// Contacts of one island by projected Gauss-Seidel in substeps: what falls, slides or is large.
//
// A substep: velocities go on changing as they did in the one before (forces and impulses alike),
// an iteration that also presses overlaps apart, bodies move, and an iteration that does not press.
// So what parts bodies is not left in their velocities. Rows keep the directions of the step's
// start; the gaps between bodies follow their displacements to first order:
//   gap = gap(start) + n . (displacement of b - displacement of a at the point)
// Sources: M. Macklin and others, "Small steps in physics simulation", Symposium on Computer
// Animation 2019: many substeps of one iteration each. Pressing by a damped spring is that of
// E. Catto, "Soft constraints", Game Developers Conference 2011. Deviation: contacts are found once
// a step.
#pragma once

#include <cstdint>
#include <vector>

#include "physics/constraints/contact_rows.hpp"
#include "physics/constraints/displacement_bounds.hpp"
#include "physics/math/indexed_span.hpp"
#include "physics/math/solver_body.hpp"
#include "physics/model/body_state.hpp"
#include "physics/model/scene.hpp"
#include "physics/solvers/blows.hpp"
#include "physics/solvers/island_motion.hpp"

namespace soda::physics {

// Of a step: one for four of the settings' `iterations`, at least one. Each takes two iterations.
std::uint32_t substeps_of(const SolverSettings& settings);

// Of the step of one island, which bears what the impulses that its bodies begin with say: twice,
// four or eight times as many, where that keeps the sag of its contacts under that small. A
// function of the argument's content.
std::uint32_t substeps_under_load(const SolveStep& step);

// Displacement of a body since the step's start.
struct Displacement {
  Vec3 linear_m = Vec3::Zero(), angular_rad = Vec3::Zero();
};

// What bodies and rows of a contact problem have besides, while its step is under way.
struct Substeps {
  std::uint32_t count = 0;
  double length_s = 0.0;
  std::vector<Displacement> displacements;   // parallel to the problem's bodies
  std::vector<PositionCorrection> at_start;  // velocities before it, of what moves
  std::vector<double> sum_newton_s;          // of the substeps that ended: three numbers a row
  std::vector<Vec3> sum_newton_m_s;          // the same of the rolling rows
};

// `problem` as build_rows leaves it: with all forces and start impulses of a step of `dt_s`, of
// which the first substep gets its share. `states` are those at the step's start; none for rows
// whose bodies are moved elsewhere.
void begin_substeps(double dt_s, std::uint32_t count, const IndexedSpan<BodyState>& states,
                    ContactProblem& problem, Substeps& substeps);

// Of a contact after those displacements, to first order.
double gap_m(const ContactProblem& problem, std::size_t row,
             const std::vector<Displacement>& displacements);

// The stages of a substep, in this order; go_on() leads to the next one.
void press(ContactProblem& problem, const Substeps& substeps);
void move_on(const ContactProblem& problem, Substeps& substeps);
void relax(ContactProblem& problem, Substeps& substeps);
void go_on(ContactProblem& problem, Substeps& substeps);

// Where an overlap grows by more than that, of the smaller body, the substeps are not taken, but
// done again in more: as many as the growth asks for, which goes with the square of their length.
// Returns the number that is to be, the same if they are to be taken.
inline constexpr std::uint32_t kMostTimesSubsteps = 8;
std::uint32_t next_count(const ContactProblem& problem, const Substeps& substeps,
                         double most_growth, std::uint32_t most);

// After the last one: the rows have the step's impulses, and as targets what its end forbids.
void end_substeps(ContactProblem& problem, const Substeps& substeps);

// What a body moves beyond its final velocity times dt_s: between its first velocity and that, and
// by position correction of at most `most_m_s` (displacement_bounds.hpp). Nothing if no impulse
// acted on it: it flies. `before`: the step's start.
PositionCorrection beyond_final_velocity(double dt_s, const FastestCorrection& most,
                                         const BodyState& before, const SolverBody& body,
                                         const Flight& flight, const Displacement& displacement);

struct SubstepWork {
  std::uint32_t iterations = 0;
  BlowWork blows;
};

// All of it, for one problem, with blows shared out (blows.hpp); `push` as in ContactSolution.
// Where an overlap grows by more than kMostGrowth, again in more substeps, at most eight times as
// many. `free`: velocities after external forces. The impulses give the island no energy
// (energy_clamp.hpp).
SubstepWork solve_in_substeps(const SolveStep& step, std::span<const SolverBody> free,
                              ContactProblem& problem, std::vector<PositionCorrection>& push);

}  // namespace soda::physics
