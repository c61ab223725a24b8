// Bodies of an island before and after its contacts are solved: what all solvers share.
#pragma once

#include <span>
#include <vector>

#include "physics/constraints/contact_rows.hpp"
#include "physics/constraints/displacement_bounds.hpp"
#include "physics/math/short_list.hpp"
#include "physics/math/solver_body.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/island_report.hpp"
#include "physics/model/stage_counters.hpp"

namespace soda::physics {

// Velocities after external forces, and the inertia that contacts meet. One body more than `ids`:
// it stands for the statics.
void load_bodies(const SolveStep& step, std::vector<SolverBody>& bodies, StageCounters& counters);

// Normal impulse and friction of a contact point.
Vec3 impulse_on_b(const ContactProblem& problem, std::size_t row);

// What the point leaves to the body `a` for the next step.
ContactImpulse stored_impulse(const IndexedSpan<ContactManifold>& manifolds,
                              const ContactProblem& problem, std::size_t row);

// A body that nothing but bounces on one other acted on flies along parabolas: its velocity changed
// at the impacts, not at the step's start. Any other body moves by its final velocity
// (semi-implicit).
struct Flight {
  bool supported = false;
  Vec3 not_yet_m = Vec3::Zero();  // displacement that impulses would have made before their impact
};

using Flights = ShortList<Flight, 4>;

// Of the problem's bodies, by its rows.
Flights find_flights(const ContactProblem& problem);

// Memory of solves that follow each other; holds nothing that counts.
struct SolveScratch {
  ContactProblem problem;
  std::vector<SolverBody> free;
  DisplacementBounds displacement_bounds;
};

// What moves a body in a step. Refers to all of it.
struct BodyMove {
  const SceneDescription& scene;
  double dt_s;
  BodyId id;
  const SolverBody& body;  // with its final velocities
  const Flight& flight;
  const PositionCorrection* correction;  // or null
};

// Its impulses stay. False if the new state would be absurd: then it keeps its old one, and a fault
// is appended.
bool move_body(const BodyMove& move, BodyState& state, std::vector<AdvanceFault>& faults);

// Potential energy that the position correction of these bodies gives; `correction` may be empty.
double push_out_work_joule(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                           std::span<const PositionCorrection> correction);

// Adds penetration, and what statics gave. `states` are those before the bodies are moved.
void report_contacts(const IndexedSpan<BodyState>& states, const ContactProblem& problem,
                     IslandReport& report);

}  // namespace soda::physics
