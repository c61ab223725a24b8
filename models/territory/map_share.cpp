#include "models/territory/map_share.hpp"

#include <algorithm>

namespace soda::models {

std::shared_ptr<const TerritoryMap> MapShare::after(
    const std::shared_ptr<const TerritoryMap>& before, std::span<const CellTransfer> transfers) {
  const std::lock_guard lock(mutex_);
  for (const Change& change : changes_)
    if (change.before == before && std::ranges::equal(change.transfers, transfers))
      return change.after;
  changes_.push_front({before,
                       {transfers.begin(), transfers.end()},
                       std::make_shared<const TerritoryMap>(before->after(transfers))});
  if (changes_.size() > kKept) changes_.pop_back();
  return changes_.front().after;
}

}  // namespace soda::models
