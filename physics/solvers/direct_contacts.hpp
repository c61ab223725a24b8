// The direct contact solver: the contacts of one island by Newton's method, where that pays.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "physics/constraints/contact_rows.hpp"
#include "physics/constraints/joint_rows.hpp"
#include "physics/math/solver_body.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/scene.hpp"
#include "physics/solvers/newton_solver.hpp"

namespace soda::physics {

// Of the heaviest to the lightest; at least one body.
double mass_ratio(const SceneDescription& scene, std::span<const BodyId> ids);

// Whether its contacts stand still against each other, nearly: it rests, or comes to rest.
bool is_quasi_static(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                     std::span<const ContactManifold> manifolds, std::span<const BodyState> states);

// The elimination by which an island is solved directly, or none if it is left to iterations:
// - where the scene has the direct solver off, or the island has rolling friction;
// - where a factorisation would cost too much. An island whose contacts move against each other may
//   cost less than one at rest;
// - without joints, where one body moves;
// - without joints and `accurate` (the scene asks for a tolerance), where two bodies of like masses
//   move;
// - without these two, where contacts move against each other, unless some bodies are much heavier
//   than others or many contacts have sunk in.
// What bounces in it is not looked at. `ids` ascending, `states` at the step's start. A function of
// the island's content.
std::optional<Elimination> plan_direct_solve(const SceneDescription& scene, double dt_s,
                                             bool accurate, std::span<const BodyId> ids,
                                             std::span<const ContactManifold> manifolds,
                                             std::span<const BodyState> states);

// The same for an impact, of few bodies: none where one body is hit, or two of like masses.
std::optional<Elimination> plan_impact_solve(const SceneDescription& scene,
                                             std::span<const BodyId> ids,
                                             std::span<const ContactManifold> manifolds);

// How near a direct solve comes: shares of the largest velocity of a point without contacts, as in
// NewtonLimits.
struct DirectAim {
  double wanted = 0.0, rounding = 0.0, accepted = 0.0;
  int factorisations = 0;  // at most; 0: as many as the island is worth
  int further = 1000;      // of these, once an error is accepted
  double stalled = 0.0;    // as in NewtonLimits: for what moves, and will be solved again
  double of_motion = 0.0;  // as there
};
// The impulses go on from step to step, so what a limit has left over is made good in the steps
// that follow. A step that is compared with others has to be solved by itself.
inline constexpr DirectAim kOngoing{1e-9, 1e-8, 2e-2}, kByItself{1e-12, 1e-10, 1e-7};
// What moves need not be solved better than to that share of its speed.
inline constexpr double kOfMotion = 3e-3;

// Velocities and impulses that fulfil all contact laws. `free`: the bodies' velocities after
// external forces, before any contact. Where it does not converge, the problem stays as it was.
// With `joints`: their rows as well, to their targets, from their impulses on.
NewtonOutcome solve_directly(const DirectAim& aim, std::span<const SolverBody> free,
                             const Elimination& plan, ContactProblem& problem,
                             JointSystem* joints = nullptr);

// As solve_position_correction (contact_solver.hpp), where needs_position_correction. `push` stays
// as it was where it does not converge. With `joints`: so that these stay as they are.
NewtonOutcome correct_positions_directly(double dt_s, const Elimination& plan,
                                         const ContactProblem& problem,
                                         std::vector<PositionCorrection>& push,
                                         const JointSystem* joints = nullptr);

}  // namespace soda::physics
