#include "models/ghosts/extrapolation_audit.hpp"

#include <algorithm>

#include "models/ghosts/extrapolated_ghosts.hpp"

namespace soda::models {

void ExtrapolationAudit::note_extrapolated(std::int64_t step, WorldId owner,
                                           std::span<const Ghost> ghosts) {
  extrapolated_[{step, owner}].assign(ghosts.begin(), ghosts.end());
}

void ExtrapolationAudit::note_news(std::int64_t step, WorldId owner, std::span<const Ghost> ghosts,
                                   WorldCounters& counters) {
  const auto found = extrapolated_.find({step, owner});
  if (found == extrapolated_.end()) return;
  const std::vector<Ghost>& extrapolated = found->second;
  std::size_t right = 0;
  for (const Ghost& ghost : ghosts)
    right += std::any_of(extrapolated.begin(), extrapolated.end(),
                         [&](const Ghost& one) { return identical(one, ghost); });
  ++counters.guesses_answered;
  counters.guesses_confirmed += right == ghosts.size() && right == extrapolated.size();
  counters.ghosts_answered += extrapolated.size();
  counters.ghosts_confirmed += right;
  extrapolated_.erase(found);
}

void ExtrapolationAudit::note_contacts(std::int64_t step, std::set<RecordKey> contacts) {
  const auto [place, is_first] = found_.try_emplace(step);
  Found& found = place->second;
  if (is_first)
    found.in_all = contacts;
  else
    std::erase_if(found.in_all, [&](const RecordKey& key) { return !contacts.contains(key); });
  found.in_any.insert(contacts.begin(), contacts.end());
  found.in_last = std::move(contacts);
}

void ExtrapolationAudit::commit(std::int64_t step, WorldCounters& counters) {
  const auto end = found_.upper_bound(step);
  for (auto place = found_.begin(); place != end; ++place) {
    const Found& found = place->second;
    counters.contacts_false += found.in_any.size() - found.in_last.size();
    counters.contacts_missed += found.in_last.size() - found.in_all.size();
  }
  found_.erase(found_.begin(), end);
  extrapolated_.erase(extrapolated_.begin(), extrapolated_.lower_bound({step + 1, WorldId{}}));
}

}  // namespace soda::models
