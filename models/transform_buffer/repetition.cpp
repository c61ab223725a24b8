#include "models/transform_buffer/repetition.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace soda::models {
namespace {

using physics::BodyId;
using physics::BodyState;
using physics::ContactManifold;

}  // namespace

void Repetition::start(std::span<const BodyId> changed, const StoredEntry* replaced,
                       const TerritoryMap& map) {
  replaced_ = replaced;
  unchanged_.clear();
  same_constants_ = true;
  if (!repeats()) return;
  const TerritoryMap* const before = rules_of(*replaced).map.get();
  same_map_ = before == &map || (before && std::ranges::equal(before->owners(), map.owners()));
  changed_.assign(changed.begin(), changed.end());
}

// Under another map of the step before, a body can be own that was not, though neither it nor the
// entry differs: only what was own in the replaced execution has left anything to take.
void Repetition::note_own(std::span<const BodyId> ids, std::span<const Migrant> migrants) {
  if (!can_take()) return;
  auto migrant = migrants.begin();
  for (const BodyId id : ids) {
    if (migrant != migrants.end() && migrant->id == id) {
      const StoredMigrant* const before = replaced_->migrants.find(id);
      if (before != nullptr && before->state.holds(migrant->state)) unchanged_.push_back(id);
      ++migrant;
    } else if (replaced_->migrants.find(id) == nullptr && replaced_->bodies.find(id) != nullptr &&
               !std::binary_search(changed_.begin(), changed_.end(), id)) {
      unchanged_.push_back(id);
    }
  }
}

// Whatever was done to it, then or now, it does not begin as it did before.
void Repetition::note_touched(std::span<const BodyId> touched) {
  if (!can_take()) return;
  const std::vector<BodyId>& before = replaced_->touched;
  if (touched.empty() && before.empty()) return;
  std::erase_if(unchanged_, [&](BodyId id) {
    return std::binary_search(touched.begin(), touched.end(), id) ||
           std::binary_search(before.begin(), before.end(), id);
  });
}

// Who tests a pair of two owners depends on the map: under another one, this world may not have
// tested what it must test now. Pairs of one owner are its own under any map.
void Repetition::note_ghosts(std::span<const Ghost> ghosts) {
  if (!can_take() || !same_map_) return;
  const auto own = static_cast<std::ptrdiff_t>(unchanged_.size());
  for (const Ghost& ghost : ghosts) {
    const StoredGhost* const before = replaced_->ghosts.find(ghost.id);
    if (before != nullptr && before->owner == ghost.owner &&
        physics::identical(before->box, ghost.box) && before->state.holds(ghost.state))
      unchanged_.push_back(ghost.id);
  }
  std::inplace_merge(unchanged_.begin(), unchanged_.begin() + own, unchanged_.end());
}

bool Repetition::unchanged(BodyId id) const {
  return physics::is_static(id) || std::binary_search(unchanged_.begin(), unchanged_.end(), id);
}

bool Repetition::take_contacts(BodyId a, BodyId b, std::vector<ContactManifold>& manifolds) const {
  if (!can_take() || !unchanged(a) || !unchanged(b)) return false;
  for (const ContactManifold& manifold : replaced_->tested.range(a))
    if (manifold.b == b) manifolds.push_back(manifold);
  return true;
}

// The same bodies, all unchanged: then the same contacts, for these are functions of their states.
bool Repetition::take_island(std::span<const BodyId> ids, std::span<BodyState> states,
                             physics::IslandReport* report) {
  if (!can_take()) return false;
  for (const BodyId id : ids) {
    if (!unchanged(id)) return false;
    const StoredBody* const before = replaced_->bodies.find(id);
    if (before == nullptr) return false;
    if (before->island.label != ids.front() || before->island.bodies != ids.size()) return false;
  }
  if (report != nullptr) {
    const physics::IslandReport* const found = replaced_->islands.find(ids.front());
    if (found == nullptr) return false;
    *report = *found;
  }
  for (std::size_t i = 0; i < ids.size(); ++i)
    replaced_->bodies.find(ids[i])->state.unpack(states[i]);
  return true;
}

bool Repetition::take_impulses(std::span<const BodyId> ids, std::span<BodyState> states) const {
  if (!repeats()) return false;
  bool any = false;
  BodyState before;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const StoredBody* const body = replaced_->bodies.find(ids[i]);
    if (body == nullptr) continue;
    body->state.unpack(before);
    states[i].impulses.swap(before.impulses);
    any = true;
  }
  return any;
}

std::vector<BodyId> Repetition::differences(std::span<const BodyId> ids,
                                            std::span<const BodyState> states) const {
  if (!repeats()) return {};
  std::vector<BodyId> own;
  SharedList<StoredBody>::Cursor replaced(replaced_->bodies);
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const StoredBody* const before = replaced.advance_to(ids[i]);
    if (before == nullptr || !before->state.holds(states[i])) own.push_back(ids[i]);
  }
  std::vector<BodyId> all;
  std::set_union(own.begin(), own.end(), replaced_->differs.begin(), replaced_->differs.end(),
                 std::back_inserter(all));
  return all;
}

}  // namespace soda::models
