// How wrong a run is: measured on committed data only, so equal for every way to execute it.
#pragma once

#include <span>
#include <vector>

#include "physics/measures/measures.hpp"
#include "physics/model/island_report.hpp"

namespace soda::analysis {

// The scales are defined in docs/accuracy.md, "Error measures". A scale of 0 gives an error of 0.
struct ErrorMeasures {
  double energy_drift_rel = 0.0;         // < 0 where contacts dissipate
  double momentum_drift_rel = 0.0;       // >= 0; a conservation check: rounding only
  double max_penetration_m = 0.0;        // deepest at the start of any step
  double constraint_residual_m_s = 0.0;  // largest of all islands and steps
  double joint_error = 0.0;              // of joints at the ends of steps, m: the largest
  double push_out_work_joule = 0.0;      // energy that displacements without velocity gave
};

// A sum that carries the rounding of each addition into the next (Kahan). Resting bodies add the
// same impulse in every step, and that rounds the same way every time: a plain sum over a million
// of them is off by 1e-11, which would pass for drift.
struct CarryingSum {
  physics::Vec3 value = physics::Vec3::Zero();
  physics::Vec3 excess = physics::Vec3::Zero();  // of value, by rounding

  void add(const physics::Vec3& part);
};

// What must be gathered while steps are committed; O(1) memory.
struct RunTotals {
  CarryingSum static_impulse_newton_s;         // summed in (step, label) order
  CarryingSum drive_impulse_newton_s;          // of each step in body order, summed by step
  double drive_impulse_scale_newton_s = 0.0;   // sum of the magnitudes, body by body
  double static_impulse_scale_newton_s = 0.0;  // sum of the magnitudes
  double max_penetration_m = 0.0;
  double constraint_residual_m_s = 0.0;
  double joint_error = 0.0;
  double push_out_work_joule = 0.0;  // where it is positive, over islands and steps
  // Of user input; see InputFollower.
  CarryingSum input_impulse_newton_s;
  double input_impulse_scale_newton_s = 0.0;
  double input_work_joule = 0.0, input_work_scale_joule = 0.0;
  double absent_mass_kg_steps = 0.0;  // of bodies that are not there, over the steps
};

// `islands` of one committed step, ascending by label; call in the order of steps.
void add_islands(std::span<const physics::IslandReport> islands, RunTotals& totals);

// Of the momentum balance: kinematic bodies neither fall nor count.
double moving_mass_kg(const physics::BodyParams& body);

// Whether the measures need the states of every step, which only drives make them do.
bool states_are_measured(const physics::SceneDescription& scene);

// What drives do in the step that starts from these states; call for each step, in order. Nothing
// without drives.
void add_drives(const physics::SceneDescription& scene, std::span<const physics::BodyId> ids,
                std::span<const physics::BodyState> states, RunTotals& totals);

// The bodies that take part, at one time.
struct PresentBodies {
  std::span<const physics::BodyId> ids;  // ascending
  std::span<const physics::BodyState> states;
};

// Over a run from `start` to `end` in `steps` steps.
ErrorMeasures measure_errors(const physics::SceneDescription& scene, const PresentBodies& start,
                             const PresentBodies& end, double steps, const RunTotals& totals);

// Over a run in which all bodies take part, from `initial` to `final_states` (index == BodyId) in
// `steps` steps.
ErrorMeasures measure_errors(const physics::SceneDescription& scene,
                             std::span<const physics::BodyState> initial,
                             std::span<const physics::BodyState> final_states, double steps,
                             const RunTotals& totals);

// Energy to lift every body by its own size (cube root of its volume). Without it, the scale of a
// scene at rest would be its own noise.
double lifting_energy_joule(const physics::SceneDescription& scene);

// BodyId{0} .. BodyId{count - 1}.
std::vector<physics::BodyId> all_ids(std::size_t count);

}  // namespace soda::analysis
