// How joints move the bodies of an island: alone, or beside contacts.
#pragma once

#include <span>
#include <vector>

#include "physics/advance.hpp"
#include "physics/joint_rows.hpp"

namespace soda::physics {

// Velocities at the end of the step by alternating sweeps over contacts with the exact solution of
// all joints, joints last. Joints pull in the directions that they have at the end of the step
// (implicit: stable however taut). Returns the number of sweeps. `states` are those before it.
int solve_with_joints(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                      std::span<const BodyState> states, JointSystem& joints,
                      ContactProblem& problem);

// Moves the bodies so that no joint that is no spring is off, by as little as their masses allow;
// `states` are those after the step. Velocities stay. Returns the energy that this
// gives: potential, and that of spins about other axes.
double close_joints(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                    JointSystem& joints, std::span<BodyState> states);

// What the world gives to the island through joints. `states` as when the rows were built.
void report_joints(std::span<const BodyState> states, const JointSystem& joints,
                   IslandReport& report);

// Advances an island that joints without springs hold and nothing touches: the joints hold at both
// ends of the step, in place and in velocity (RATTLE with the free rotation of each body, symmetric
// in time: second order with limits, motors, drives or damping, else five of them for the fourth).
// `report` has its label;
// to its impulse by statics is added what damping and drives gave beyond what drive_impulse
// (measures.hpp) tells of the start, as velocities that the joints change are damped. False, and no
// change, if that does not work out because the joints are nearly contradictory: then they have to
// be solved as beside contacts.
bool advance_linkage(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                     JointSystem& joints, std::span<BodyState> states, IslandReport& report,
                     std::vector<AdvanceFault>& faults);

// A body with a joint whose other body is not in the island: it was farther away than the joint
// reaches, or is not known yet.
void report_lost_joints(const SceneDescription& scene, std::span<const BodyId> ids,
                        std::span<const ContactManifold> manifolds,
                        std::vector<AdvanceFault>& faults);

}  // namespace soda::physics
