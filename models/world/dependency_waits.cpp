#include "models/world/dependency_waits.hpp"

namespace soda::models {

void DependencyWaits::start(const Dependencies& before) {
  before_ = before;
  expected_ = expected_from(before_, self_);
  next_ = {};
  if (on_) next_.migrants = before_.left_to;
}

std::vector<WorldId> DependencyWaits::partners_in(std::uint32_t round) const {
  std::vector<WorldId> partners;
  for (const auto& [sent, world] : before_.sent)
    if (sent == round) partners.push_back(world);
  return partners;
}

void DependencyWaits::note_migrants_from(std::span<const WorldId> sources) {
  if (!on_) return;
  next_.migrants.insert(next_.migrants.end(), sources.begin(), sources.end());
  sort_unique(next_.migrants);
}

void DependencyWaits::note_migrants_to(std::map<WorldId, std::vector<Migrant>>& leaving) {
  if (!on_) return;
  for (const auto& [owner, migrants] : leaving) next_.left_to.push_back(owner);
  for (const WorldId expecting : next_.migrants) leaving[expecting];
}

void DependencyWaits::note_tested_for(WorldId other) {
  if (on_) next_.tested_for.push_back(other);
}

void DependencyWaits::note_tester(WorldId other) {
  if (on_) next_.testers.push_back(other);
}

void DependencyWaits::note_records_to(std::uint32_t round, WorldId other) {
  if (on_) next_.sent.emplace_back(round, other);
}

void DependencyWaits::note_records_from(std::uint32_t round, WorldId other) {
  if (on_) next_.received.emplace_back(round, other);
}

void DependencyWaits::note_island(std::span<const physics::BodyId> ids,
                                  std::span<const WorldId> owners) {
  if (on_) note_group(ids, owners, self_, next_.groups);
}

}  // namespace soda::models
