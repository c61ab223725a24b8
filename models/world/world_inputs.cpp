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
  // While messages are missing a body can be here that others believe to be absent, or the other
  // way round: what is here is what counts.
  for (const UserInput& input : inputs) {
    if (!account->presence.note(input)) continue;
    if (note_change(input, *rules_.scene, account->changes)) continue;
    if (input.kind == InputKind::kAdd && rules_.map->owner_at(input.state.position_m) != id_)
      continue;
    if (act_on_bodies(input, *rules_.scene, ids_, states_)) touched.push_back(input.body);
  }
  rules_.scene = around_.scenes.with(account->changes);
  rules_.inputs = std::move(account);
  std::sort(touched.begin(), touched.end());
  touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
  return touched;
}

}  // namespace soda::models
