// User input in a world: what the messages for the beginning of a step do to it.
#include <algorithm>
#include <utility>

#include "models/world/world.hpp"

namespace soda::models {

using physics::BodyId;

// Every world hears of every input, for all of them keep the same account of which bodies take part
// and what they are made of; the owner alone, or the world that owns the place, acts on the body.
// Returns the bodies that were touched here, ascending.
std::vector<BodyId> World::take_inputs(Bag bag) {
  std::vector<UserInput> inputs;
  for (const kernel::MessageView& message : bag)
    if (message.kind == static_cast<std::uint32_t>(MessageKind::kInputs))
      inputs.push_back(decode_input(message.payload));
  if (inputs.empty()) return {};
  counters_.inputs += inputs.size();
  std::sort(inputs.begin(), inputs.end(), acts_before);
  auto account = std::make_shared<InputAccount>(*rules_.inputs);
  std::vector<BodyId> touched;
  for (const UserInput& input : inputs) {
    if (!account->presence.note(input)) continue;
    if (input.kind == InputKind::kChangeMaterial)
      set_material(input.body, input.material, account->changes);
    else if (input.kind == InputKind::kSetMotor)
      set_motor(input.joint,
                motor_after(input, motor_with(*rules_.scene, account->changes, input.joint)),
                account->changes);
    else if (act(input))
      touched.push_back(input.body);
  }
  rules_.scene = around_.scenes.with(account->changes);
  rules_.inputs = std::move(account);
  std::sort(touched.begin(), touched.end());
  touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
  return touched;
}

// Whether it concerned an own body. While messages are missing a body can be here that others
// believe to be absent, or the other way round: what is here is what counts.
bool World::act(const UserInput& input) {
  const auto place = std::lower_bound(ids_.begin(), ids_.end(), input.body);
  const bool is_here = place != ids_.end() && *place == input.body;
  const auto state = states_.begin() + (place - ids_.begin());
  if (input.kind == InputKind::kAdd) {
    if (is_here || rules_.map->owner_at(input.state.position_m) != id_) return false;
    states_.insert(state, input.state);
    ids_.insert(place, input.body);
    return true;
  }
  if (!is_here) return false;
  if (input.kind == InputKind::kRemove) {
    states_.erase(state);
    ids_.erase(place);
  } else {
    act_on(input, rules_.scene->bodies[physics::index_of(input.body)], *state);
  }
  return true;
}

}  // namespace soda::models
