#include "analysis/measures/input_measures.hpp"

#include <algorithm>
#include <cmath>

namespace soda::analysis {
namespace {

using physics::BodyId;
using physics::BodyState;

// Of one body; nothing if it is not there.
physics::Mechanics mechanics_of(const physics::SceneDescription& scene, BodyId body,
                                std::span<const BodyId> ids, std::span<const BodyState> states) {
  const auto place = std::lower_bound(ids.begin(), ids.end(), body);
  if (place == ids.end() || *place != body) return {};
  return physics::measure(scene, {&body, 1},
                          states.subspan(static_cast<std::size_t>(place - ids.begin()), 1));
}

}  // namespace

bool is_followed(const models::InputOptions& inputs) {
  return inputs.any() || !inputs.absent.empty();
}

InputFollower::InputFollower(const physics::SceneDescription& scene,
                             std::span<const BodyState> initial, const models::InputOptions& inputs)
    : scene_(scene), changed_(scene) {
  const models::Presence presence(inputs.absent);
  for (std::uint32_t i = 0; i < initial.size(); ++i) {
    if (!presence.has(BodyId{i})) continue;
    ids_.push_back(BodyId{i});
    states_.push_back(initial[i]);
  }
}

void InputFollower::follow(const models::CommittedStep& step, RunTotals& totals) {
  for (const models::CommittedInput& committed : step.inputs)
    if (committed.had_effect) add(committed.input, totals);
  add_drives(scene_, ids_, states_, totals);
  double mass_kg = 0.0, present_kg = 0.0;
  for (const physics::BodyParams& body : scene_.bodies) mass_kg += moving_mass_kg(body);
  for (const BodyId id : ids_) present_kg += moving_mass_kg(scene_.bodies[physics::index_of(id)]);
  totals.absent_mass_kg_steps += ids_.size() == scene_.bodies.size() ? 0.0 : mass_kg - present_kg;
  ids_.assign(step.ids.begin(), step.ids.end());
  states_.assign(step.states.begin(), step.states.end());
}

void InputFollower::add(const models::UserInput& input, RunTotals& totals) {
  const physics::Mechanics before = mechanics_of(scene_, input.body, ids_, states_);
  models::act_on_scene(input, changed_, ids_, states_);
  const physics::Mechanics after = mechanics_of(scene_, input.body, ids_, states_);
  const physics::Vec3 impulse = after.linear_momentum_newton_s - before.linear_momentum_newton_s;
  totals.input_impulse_newton_s.add(impulse);
  totals.input_impulse_scale_newton_s += impulse.norm();
  const double work = after.kinetic_energy_joule + after.potential_energy_joule -
                      before.kinetic_energy_joule - before.potential_energy_joule;
  totals.input_work_joule += work;
  totals.input_work_scale_joule += std::fabs(work);
}

}  // namespace soda::analysis
