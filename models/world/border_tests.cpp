#include "models/world/border_tests.hpp"

#include <map>
#include <vector>

#include "models/world/absorption.hpp"

namespace soda::models {

void BorderTests::send_ghosts(std::int64_t step, Outgoing& out) {
  const std::vector<physics::Aabb>& boxes = step_.scratch.boxes;
  std::map<WorldId, std::vector<Ghost>> ghosts;
  for (const WorldId expecting : waits_.expected().ghosts_to) ghosts[expecting];
  for (const WorldId expecting : extrapolation_.pending_notices()) ghosts[expecting];
  covers_.start(step_.rules.map, step_.self, step_.ids.size());
  std::vector<std::uint64_t> keys;
  for (std::size_t i = 0; i < step_.ids.size(); ++i) {
    const CoveredCells covered = covers_.find(i, boxes[i]);
    for (const std::uint32_t cell : covered.border_cells) keys.push_back(border_key(cell, i));
    for (const std::uint32_t owner : covered.others)
      ghosts[WorldId{owner}].push_back({step_.ids[i], step_.self, boxes[i], step_.states[i]});
  }
  WorldCounters& counters = step_.work.worlds;
  counters.border_tests += step_.ids.size();
  if (step_.remembers) index_border(step_.ids, boxes, keys, step_.memo.border);
  for (const auto& [owner, bodies] : ghosts) {
    counters.ghosts_sent += bodies.size();
    if (!bodies.empty()) extrapolation_.note_ghosts_to(owner);
    out.send(owner, time_of(step, Phase::kBorderTraversal), MessageKind::kGhosts,
             encode_ghosts(bodies));
  }
}

bool BorderTests::send_migrants(std::int64_t step, Outgoing& out) {
  std::map<WorldId, std::vector<Migrant>> leaving;
  for (std::size_t i = 0; i < step_.ids.size(); ++i) {
    const physics::BodyState& state = step_.states[i];
    if (covers_.keeps(i, state.position_m)) continue;
    const WorldId owner = step_.rules.map->owner_at(state.position_m);
    if (owner == step_.self) continue;
    leaving[owner].push_back({step_.ids[i], state});
    extrapolation_.note_migrant_to(owner, step_.ids[i], state);
  }
  const bool somebody_leaves = !leaving.empty();
  waits_.note_migrants_to(leaving);
  for (const auto& [owner, migrants] : leaving) {
    step_.work.worlds.migrations += migrants.size();
    out.send(owner, time_of(step + 1, Phase::kBegin), MessageKind::kMigrants,
             encode_migrants(migrants));
  }
  return somebody_leaves;
}

}  // namespace soda::models
