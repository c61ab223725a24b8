#include "analysis/measures/error_measures.hpp"

#include <algorithm>
#include <cmath>

#include "physics/shapes/mass_properties.hpp"

namespace soda::analysis {
namespace {

double relative(double value, double scale) { return scale > 0.0 ? value / scale : 0.0; }

double total_mass_kg(const physics::SceneDescription& scene) {
  double mass = 0.0;
  for (const physics::BodyParams& body : scene.bodies) mass += moving_mass_kg(body);
  return mass;
}

}  // namespace

double moving_mass_kg(const physics::BodyParams& body) {
  return body.kinematic ? 0.0 : body.mass_kg;
}

double lifting_energy_joule(const physics::SceneDescription& scene) {
  std::vector<double> size_m;
  for (const physics::Shape& shape : scene.shapes) {
    size_m.push_back(std::cbrt(physics::mass_properties(shape, scene.shapes).volume_m3));
  }
  const double gravity = scene.gravity_m_s2.norm();
  double energy = 0.0;
  for (const physics::BodyParams& body : scene.bodies) {
    energy += body.mass_kg * gravity * size_m[body.shape];
  }
  return energy;
}

void CarryingSum::add(const physics::Vec3& part) {
  const physics::Vec3 wanted = part - excess;
  const physics::Vec3 next = value + wanted;
  const physics::Vec3 added = next - value;
  excess = added - wanted;
  value = next;
}

void add_islands(std::span<const physics::IslandReport> islands, RunTotals& totals) {
  for (const physics::IslandReport& island : islands) {
    totals.static_impulse_newton_s.add(island.static_impulse_newton_s);
    totals.static_impulse_scale_newton_s += island.static_impulse_newton_s.norm();
    totals.max_penetration_m = std::max(totals.max_penetration_m, island.max_penetration_m);
    totals.constraint_residual_m_s =
        std::max(totals.constraint_residual_m_s, island.constraint_residual_m_s);
    totals.joint_error = std::max(totals.joint_error, island.joint_error);
    totals.push_out_work_joule += std::max(0.0, island.push_out_work_joule);
  }
}

bool states_are_measured(const physics::SceneDescription& scene) {
  return !scene.drives.empty() || std::ranges::any_of(scene.bodies, physics::is_forced);
}

void add_drives(const physics::SceneDescription& scene, std::span<const physics::BodyId> ids,
                std::span<const physics::BodyState> states, RunTotals& totals) {
  if (!states_are_measured(scene)) return;
  const physics::DriveImpulse impulse = physics::drive_impulse(scene, ids, states);
  totals.drive_impulse_newton_s.add(impulse.sum_newton_s);
  totals.drive_impulse_scale_newton_s += impulse.scale_newton_s;
}

ErrorMeasures measure_errors(const physics::SceneDescription& scene,
                             std::span<const physics::BodyState> initial,
                             std::span<const physics::BodyState> final_states, double steps,
                             const RunTotals& totals) {
  const std::vector<physics::BodyId> ids = all_ids(initial.size());
  return measure_errors(scene, {ids, initial}, {ids, final_states}, steps, totals);
}

ErrorMeasures measure_errors(const physics::SceneDescription& scene, const PresentBodies& first,
                             const PresentBodies& last, double steps, const RunTotals& totals) {
  const physics::Mechanics start = physics::measure(scene, first.ids, first.states);
  const physics::Mechanics end = physics::measure(scene, last.ids, last.states);

  const double kinetic_change = end.kinetic_energy_joule - start.kinetic_energy_joule;
  const double potential_change = end.potential_energy_joule - start.potential_energy_joule;
  const double energy_scale =
      std::max({start.kinetic_energy_joule, end.kinetic_energy_joule, std::fabs(potential_change),
                lifting_energy_joule(scene), totals.input_work_scale_joule});

  const physics::Vec3 gravity_impulse =
      scene.gravity_m_s2 *
      ((total_mass_kg(scene) * steps - totals.absent_mass_kg_steps) * scene.dt_s);
  const physics::Vec3 unexplained = end.linear_momentum_newton_s - start.linear_momentum_newton_s -
                                    gravity_impulse - totals.static_impulse_newton_s.value -
                                    totals.drive_impulse_newton_s.value -
                                    totals.input_impulse_newton_s.value;
  const double momentum_scale =
      std::max({start.momentum_scale_newton_s, end.momentum_scale_newton_s, gravity_impulse.norm(),
                totals.static_impulse_scale_newton_s, totals.drive_impulse_scale_newton_s,
                totals.input_impulse_scale_newton_s});

  return {relative(kinetic_change + potential_change - totals.input_work_joule, energy_scale),
          relative(unexplained.norm(), momentum_scale),
          totals.max_penetration_m,
          totals.constraint_residual_m_s,
          totals.joint_error,
          totals.push_out_work_joule};
}

std::vector<physics::BodyId> all_ids(std::size_t count) {
  std::vector<physics::BodyId> ids(count);
  for (std::size_t i = 0; i < count; ++i) ids[i] = static_cast<physics::BodyId>(i);
  return ids;
}

}  // namespace soda::analysis
