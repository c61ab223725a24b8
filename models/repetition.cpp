#include "models/repetition.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace soda::models {
namespace {

using physics::BodyId;
using physics::BodyState;
using physics::ContactManifold;

template <class T>
const T* find_id(const std::vector<T>& sorted, BodyId id) {
  const auto place =
      std::lower_bound(sorted.begin(), sorted.end(), id,
                       [](const T& item, BodyId wanted) { return item.id < wanted; });
  return place != sorted.end() && place->id == id ? &*place : nullptr;
}

}  // namespace

void Repetition::start(std::span<const BodyId> changed, BufferEntry* replaced,
                       const TerritoryMap& map) {
  replaced_ = replaced;
  unchanged_.clear();
  if (!repeats()) return;
  const TerritoryMap* const before = replaced->rules.map.get();
  same_map_ = before == &map || (before && std::ranges::equal(before->owners(), map.owners()));
  changed_.assign(changed.begin(), changed.end());
  taken_.assign(replaced->ids.size(), false);
}

// Under another map of the step before, a body can be own that was not, though neither it nor the
// entry differs: only what was own in the replaced execution has left anything to take.
void Repetition::note_own(std::span<const BodyId> ids, std::span<const Migrant> migrants) {
  if (!can_take()) return;
  auto migrant = migrants.begin();
  for (const BodyId id : ids) {
    if (migrant != migrants.end() && migrant->id == id) {
      const Migrant* const before = find_id(replaced_->memo.migrants, id);
      if (before != nullptr && physics::identical(before->state, migrant->state))
        unchanged_.push_back(id);
      ++migrant;
    } else if (find_id(replaced_->memo.migrants, id) == nullptr &&
               place_of(id) < replaced_->ids.size() &&
               !std::binary_search(changed_.begin(), changed_.end(), id)) {
      unchanged_.push_back(id);
    }
  }
}

// Whatever was done to it, then or now, it does not begin as it did before.
void Repetition::note_touched(std::span<const BodyId> touched) {
  if (!can_take()) return;
  const std::vector<BodyId>& before = replaced_->memo.touched;
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
    const Ghost* const before = find_id(replaced_->memo.ghosts, ghost.id);
    if (before != nullptr && identical(*before, ghost)) unchanged_.push_back(ghost.id);
  }
  std::inplace_merge(unchanged_.begin(), unchanged_.begin() + own, unchanged_.end());
}

bool Repetition::unchanged(BodyId id) const {
  return physics::is_static(id) || std::binary_search(unchanged_.begin(), unchanged_.end(), id);
}

bool Repetition::take_contacts(BodyId a, BodyId b, std::vector<ContactManifold>& manifolds) const {
  if (!can_take() || !unchanged(a) || !unchanged(b)) return false;
  const auto before = [](const ContactManifold& manifold, std::pair<BodyId, BodyId> pair) {
    return std::pair(manifold.a, manifold.b) < pair;
  };
  const std::vector<ContactManifold>& tested = replaced_->memo.tested;
  auto place = std::lower_bound(tested.begin(), tested.end(), std::pair(a, b), before);
  for (; place != tested.end() && place->a == a && place->b == b; ++place)
    manifolds.push_back(*place);
  return true;
}

std::size_t Repetition::place_of(BodyId id) const {
  const std::vector<BodyId>& ids = replaced_->ids;
  const auto place = std::lower_bound(ids.begin(), ids.end(), id);
  if (place == ids.end() || *place != id) return ids.size();
  return static_cast<std::size_t>(place - ids.begin());
}

// The same bodies, all unchanged: then the same contacts, for these are functions of their states.
bool Repetition::take_island(std::span<const BodyId> ids, std::span<BodyState> states,
                             physics::IslandReport* report) {
  if (!can_take()) return false;
  for (const BodyId id : ids) {
    if (!unchanged(id)) return false;
    const std::size_t place = place_of(id);
    if (place == replaced_->ids.size()) return false;
    const StepMemo::Membership& member = replaced_->memo.islands[place];
    if (member.label != ids.front() || member.bodies != ids.size()) return false;
  }
  if (report != nullptr) {
    const auto& reports = replaced_->islands;
    const auto found = std::lower_bound(
        reports.begin(), reports.end(), ids.front(),
        [](const physics::IslandReport& r, BodyId label) { return r.label < label; });
    if (found == reports.end() || found->label != ids.front()) return false;
    *report = *found;
  }
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const std::size_t place = place_of(ids[i]);
    std::swap(states[i], replaced_->states[place]);
    taken_[place] = true;
  }
  return true;
}

std::vector<BodyId> Repetition::differences(std::span<const BodyId> ids,
                                            std::span<const BodyState> states) const {
  if (!repeats()) return {};
  std::vector<BodyId> own;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const std::size_t place = place_of(ids[i]);
    const bool same = place < replaced_->ids.size() &&
                      (taken_[place] || physics::identical(states[i], replaced_->states[place]));
    if (!same) own.push_back(ids[i]);
  }
  std::vector<BodyId> all;
  std::set_union(own.begin(), own.end(), replaced_->differs.begin(), replaced_->differs.end(),
                 std::back_inserter(all));
  return all;
}

}  // namespace soda::models
