#include "models/world/arrivals.hpp"

#include <algorithm>
#include <memory>
#include <utility>

namespace soda::models {

using physics::BodyId;
using physics::BodyState;

Arrivals read_arrivals(Bag bag) {
  Arrivals arrivals;
  for (const kernel::MessageView& message : bag) {
    if (message.kind == static_cast<std::uint32_t>(MessageKind::kTransfers))
      decode_transfers(message.payload, arrivals.transfers);
    if (message.kind != static_cast<std::uint32_t>(MessageKind::kMigrants)) continue;
    const std::size_t before = arrivals.migrants.size();
    decode_migrants(message.payload, arrivals.migrants);
    if (arrivals.migrants.size() != before)
      arrivals.sources.push_back(WorldId{kernel::index_of(message.source)});
  }
  return arrivals;
}

void drop_foreign(const TerritoryMap& map, WorldId self, std::vector<BodyId>& ids,
                  std::vector<BodyState>& states) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (map.owner_at(states[i].position_m) != self) continue;
    if (kept != i) {
      ids[kept] = ids[i];
      states[kept] = std::move(states[i]);
    }
    ++kept;
  }
  ids.resize(kept);
  states.resize(kept);
}

std::vector<Migrant> merge_migrants(std::vector<Migrant> migrants, std::vector<BodyId>& ids,
                                    std::vector<BodyState>& states) {
  std::stable_sort(migrants.begin(), migrants.end(),
                   [](const Migrant& a, const Migrant& b) { return a.id < b.id; });
  const auto is_here = [&ids, &states](const Migrant& migrant) {
    const auto place = std::lower_bound(ids.begin(), ids.end(), migrant.id);
    if (place != ids.end() && *place == migrant.id) return true;
    states.insert(states.begin() + (place - ids.begin()), migrant.state);
    ids.insert(place, migrant.id);
    return false;
  };
  std::erase_if(migrants, is_here);
  return migrants;
}

std::vector<BodyId> take_inputs(StepInProgress& step, Bag bag) {
  std::vector<UserInput> inputs;
  for (const kernel::MessageView& message : bag)
    if (message.kind == static_cast<std::uint32_t>(MessageKind::kInputs))
      inputs.push_back(decode_input(message.payload));
  if (inputs.empty()) return {};
  step.work.worlds.inputs += inputs.size();
  std::sort(inputs.begin(), inputs.end(), acts_before);
  Rules& rules = step.rules;
  auto account = std::make_shared<InputAccount>(*rules.inputs);
  std::vector<BodyId> touched;
  // While messages are missing a body can be here that others believe to be absent, or the other
  // way round: what is here is what counts.
  for (const UserInput& input : inputs) {
    if (!account->presence.note(input)) continue;
    if (note_change(input, *rules.scene, account->changes)) continue;
    if (input.kind == InputKind::kAdd && rules.map->owner_at(input.state.position_m) != step.self)
      continue;
    if (act_on_bodies(input, *rules.scene, step.ids, step.states)) touched.push_back(input.body);
  }
  rules.scene = step.around.scenes.with(account->changes);
  rules.inputs = std::move(account);
  std::sort(touched.begin(), touched.end());
  touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
  return touched;
}

}  // namespace soda::models
