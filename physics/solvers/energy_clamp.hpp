// The work of contact impulses. Those that fulfil the contact laws take energy out of an island, by
// rebounds at most as much as the impact took comes back; what a solver has left unsolved must not
// put any in.
#pragma once

#include <span>
#include <vector>

#include "physics/constraints/contact_rows.hpp"
#include "physics/math/indexed_span.hpp"
#include "physics/math/solver_body.hpp"
#include "physics/solvers/island_motion.hpp"

namespace soda::physics {

// Energies, and the sum of their magnitudes.
struct Work {
  double sum = 0.0, scale = 0.0;

  void add(double part) {
    sum += part;
    scale += part < 0.0 ? -part : part;
  }
  void add(const Work& other) {
    sum += other.sum;
    scale += other.scale;
  }
};
bool is_more_than_rounding(const Work& work);

// What surfaces that move have to do with the energy of bodies. Contact laws bound what is lost in
// velocities relative to a surface, not what the surface gives: in a wedge that pressure locks,
// impulses, and what the surface gives, grow without bound.
struct Driven {
  double surface_m_s = 0.0;  // the fastest that something rubs on; 0: none
  double mass_kg = 0.0;
  // Kinetic energy with none, half, and all of the impulses.
  double without_joule = 0.0, half_joule = 0.0, after_joule = 0.0;

  void add(const Driven& other);
};
// Whether bodies are faster than what they have and the surface's speed, given to all of them,
// explain: the root of the energy grows by no more than that of the mass at the surface's speed.
bool is_too_fast(const Driven& driven);
// Of all impulses: the greatest that makes no body too fast.
double share_as_driven(const Driven& driven);

// What a step does to the energy of an island or of a part of it, joule.
struct StepWork {
  // Twice what contact impulses do to bodies that go from the free velocities to those after it: as
  // if they acted at the latter, at the former.
  Work after, without;
  Work
      fields;  // external forces, taken for those of a field: kinetic energy less what is potential
  Driven driven;

  void add(const StepWork& other);
};
// Adds the rows' part. `free`: velocities after external forces, without contacts.
void add_contacts(std::span<const SolverBody> free, const ContactProblem& problem, StepWork& work);
// Adds the bodies' part of what surfaces drive. `start`: velocities without the impulses.
void add_driven(std::span<const SolverBody> start, const ContactProblem& problem, StepWork& work);
// Adds the bodies' part. `held`: which bodies move by their final velocity; `flights`: how impacts
// within the step move the others.
void add_fields(const SolveStep& step, std::span<const SolverBody> free, const Flights& held,
                const Flights& flights, const ContactProblem& problem, StepWork& work);
// What the step gives, what moves beyond its final velocity not counted.
Work gain_of(const StepWork& work);
// Whether that is more than rounding, or something is too fast.
bool gives_energy(const StepWork& work);
// Of the way between two solutions: the greatest that gives nothing. The gain is a convex quadratic
// through (0, at0), (1/2, at_half), (1, at1) with at1 > 0; 0 if there is no such share.
double share_without_gain(double at0, double at_half, double at1);
// Of all impulses: the greatest that does no work in the velocities that it leads to.
double share_without_work(const StepWork& work);
// Of all impulses: all, or the greatest that puts in no energy and makes nothing too fast.
double allowed_share(const StepWork& work);

// Scales all impulses, and the velocities with them, to where they do no work in the velocities
// that they lead to; leaves them alone where they do none. `free`: velocities after external
// forces, without contacts. Momentum, the friction cones and the signs of impulses stay; a contact
// closes by the share that is taken off. Targets are at most 0: rebounds come later.
void clamp_work(std::span<const SolverBody> free, ContactProblem& problem);

// The same where the step gives the island energy, potential energy in the field of the external
// forces included; what moves beyond its final velocity is not counted.
void clamp_gain(const SolveStep& step, std::span<const SolverBody> free, ContactProblem& problem);

// The impulses of a problem, and the velocities that they lead to.
struct SolvedContacts {
  std::vector<SolverBody> bodies;
  std::vector<double> normal_newton_s;
  std::vector<Vec3> friction_newton_s;  // x, y: the two tangents
  std::vector<RollingRow> rollings;
};
SolvedContacts solved_contacts(const ContactProblem& problem);

// Makes of impulses and velocities from + share (to - from), where `to` is what the problem holds;
// no `from`: no impulses.
void take_share(double share, std::span<const SolverBody> from_bodies, const SolvedContacts* from,
                ContactProblem& problem);

// After rebounds were solved for: goes back towards the solution without them so far that the step
// gives the island no energy, potential energy in the field of the external forces included. On an
// impact no force acts. `plastic`: that solution.
void clamp_rebounds(const SolveStep& step, std::span<const SolverBody> free,
                    const SolvedContacts& plastic, ContactProblem& problem);

// A body in flight may end a step faster downwards than would close a gap, as its path is curved.
// If one that is held after all is so fast that it would get through: gives all contacts the target
// to close, none bounces any more, and returns true. Then they are to be solved again.
bool aim_to_close(double dt_s, ContactProblem& problem);

// What kinematic bodies, at their velocities in `free`, give the others by the problem's impulses.
double kinematic_work_joule(std::span<const SolverBody> free, const ContactProblem& problem);

}  // namespace soda::physics
