#include "scenarios/random_inputs.hpp"

#include <algorithm>

#include "scenarios/random.hpp"

namespace soda::scenarios {
namespace {

using models::InputKind;
using models::UserInput;

UserInput draw_input(RandomStream& random, const Scenario& scenario) {
  const auto below = [&random](std::uint64_t bound) { return next_bits(random) % bound; };
  constexpr double kSpeed_m_s = 2.0, kSpin_rad_s = 3.0;
  UserInput input;
  input.step = static_cast<std::int64_t>(
      below(static_cast<std::uint64_t>(std::max<std::int64_t>(scenario.run.steps, 1))));
  input.kind = static_cast<InputKind>(below(5));
  const auto body = static_cast<std::uint32_t>(below(scenario.initial.size()));
  input.body = physics::BodyId{body};
  const bool comes_or_goes = input.kind == InputKind::kAdd || input.kind == InputKind::kRemove;
  if (comes_or_goes && scenario.scene.bodies[body].joints > 0) input.kind = InputKind::kPush;
  const physics::BodyState& declared = scenario.declared_state(body);
  input.state.position_m = declared.position_m;
  input.state.orientation = declared.orientation;
  input.state.position_m += 2.0 * scenario.territory.grid.cell_size_m * uniform_in_ball(random);
  input.state.linear_velocity_m_s = kSpeed_m_s * uniform_in_ball(random);
  input.state.angular_velocity_rad_s = kSpin_rad_s * uniform_in_ball(random);
  input.sets_linear = below(2) == 0;
  input.sets_angular = !input.sets_linear || below(2) == 0;
  const double mass_kg = scenario.scene.bodies[body].mass_kg;
  input.impulse_newton_s = mass_kg * kSpeed_m_s * uniform_in_ball(random);
  input.material = {uniform(random, 0.0, 1.0), uniform(random, 0.0, 0.5)};
  return input;
}

}  // namespace

void add_random_inputs(std::uint64_t seed, Scenario& scenario) {
  const std::size_t bodies = scenario.initial.size();
  if (bodies == 0) return;
  std::vector<UserInput>& script = scenario.run.inputs.script;
  std::uint32_t next_id = 0;
  for (const UserInput& input : script) next_id = std::max(next_id, input.id + 1);
  RandomStream random = make_stream(seed, 0x696e);
  const std::size_t count = std::clamp<std::size_t>(bodies / 2, 8, 200);
  for (std::size_t i = 0; i < count; ++i) {
    script.push_back(draw_input(random, scenario));
    script.back().id = next_id++;
  }
}

}  // namespace soda::scenarios
