// Contacts of bodies that joints hold: iterations in which each contact meets all that hangs on its
// bodies.
#pragma once

#include <optional>
#include <vector>

#include "physics/constraints/contact_rows.hpp"
#include "physics/constraints/joint_rows.hpp"

namespace soda::physics {

// What an impulse along one direction of a contact point does to all bodies, joints included.
struct JointedDirection {
  std::vector<JointMove> moves;  // m/s and rad/s for 1 newton s, of each body
  double inverse_mass = 0.0;     // velocity along itself
  bool is_clear = false;         // whether rounding has left enough of it to go by
  // Velocity by which a normal gives way for 1 newton s: 0, but where a short lever would throw
  // something at a multiple of the contact's own velocity.
  double give_1_kg = 0.0;
};

// Of a contact problem and the joints that take part in a solution.
struct JointedContacts {
  std::vector<JointedDirection> normals;
  std::vector<JointedDirection> tangents;  // two for each friction row
  std::vector<double> slide_mass_kg;       // of each friction row: of its lightest direction
  // Three for each rolling row; without moves where joints let nothing turn.
  std::vector<JointedDirection> rollings;
  std::vector<double> slide_inertia_kg_m2;  // as slide_mass_kg
};

// `joints` are factored. None if that costs too much, or a contact can hardly move: where joints
// hold it still, or tie it to what is much heavier.
std::optional<JointedContacts> jointed_contacts(const JointSystem& joints,
                                                const ContactProblem& problem);

struct JointedSolve {
  int iterations = 0;
  double change = 0.0;  // the least that an iteration came down to, of an impulse
};
// Whether a change that is this much less than that before is no progress.
bool is_stalled(double change, double before);

// Iterates, accelerated (anderson.hpp), until the largest change of an impulse is negligible, or
// ten iterations have not made it less, or there have been enough; velocities and impulses of
// contacts change, but those of joints have to be solved for once more.
JointedSolve solve_jointed_velocities(int iterations, const JointedContacts& contacts,
                                      ContactProblem& problem);

}  // namespace soda::physics
