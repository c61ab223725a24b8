// How joints move the bodies of an island beside contacts, or where they contradict each other.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "physics/constraints/contact_rows.hpp"
#include "physics/constraints/joint_rows.hpp"
#include "physics/math/block_cholesky.hpp"
#include "physics/math/solver_body.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/island_report.hpp"
#include "physics/model/island_step.hpp"
#include "physics/solvers/contact_choice.hpp"

namespace soda::physics {

// Errors of rounding of coordinates up to the largest, and of what reaches that far from a centre.
double rounding_of(std::span<const BodyState> states, double reach_m);

// Velocities and inertia as the states have them; one body more, for the world.
std::vector<SolverBody> bodies_at(const SceneDescription& scene, std::span<const BodyId> ids,
                                  std::span<const BodyState> states);

// From `states` on, with these velocities and no force. Other fields of `next` stay.
void drift_to(const SceneDescription& scene, std::span<const BodyId> ids,
              std::span<const BodyState> states, std::span<const SolverBody> bodies, double dt_s,
              std::span<BodyState> next);
std::vector<BodyState> drifted(const SceneDescription& scene, std::span<const BodyId> ids,
                               std::span<const BodyState> states,
                               std::span<const SolverBody> bodies, double dt_s);

// One step of an island with joints. `states` are those before it, `free` the velocities after
// external forces.
struct JointedStep {
  const IslandStep& island;
  std::span<const BodyState> states;
  std::span<const SolverBody> free;
};

// Its solution: joints and contacts with their impulses, and what is pushed apart (may be empty).
struct JointedSolution {
  const JointSystem& joints;
  const ContactProblem& problem;
  std::span<const PositionCorrection> push;
  bool compared = false;  // with steps of other lengths: no part of it may be of another order
};

// The same by Newton's method, of joints and contacts at once. Nothing, and the problem as it was,
// where that does not converge, throws something, or masses are too unequal.
std::optional<ContactSolution> solve_jointed_directly(const JointedStep& step, bool accurate,
                                                      const Elimination& plan, JointSystem& joints,
                                                      ContactProblem& problem);

// Velocities at the end of the step, rebounds and position correction. They give no energy but by
// motors, springs and what pushes the bodies.
ContactSolution solve_jointed(const JointedStep& step, JointSystem& joints,
                              ContactProblem& problem);

// Moves the bodies (`states`, as before the step), closes what that opens of the joints, takes the
// energy away that this gives, and pushes overlaps apart. Stored impulses stay. Adds the works to
// the report: that of closing counts as position correction where position correction had opened
// them.
void move_jointed(const JointedStep& step, const JointedSolution& solved,
                  std::span<BodyState> states, IslandReport& report,
                  std::vector<AdvanceFault>& faults);

// What the world gives to the island through joints, and what those that can break bear. `states`
// as when the rows were built.
void report_joints(std::span<const BodyState> states, const JointSystem& joints,
                   IslandReport& report);

// A body with a joint whose other body is not in the island: it was farther away than the joint
// reaches, or is not known yet.
void report_lost_joints(const SceneDescription& scene, std::span<const BodyId> ids,
                        std::span<const ContactManifold> manifolds,
                        std::span<const BodyState> states, std::vector<AdvanceFault>& faults);

}  // namespace soda::physics
