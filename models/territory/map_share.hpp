// One territory map for all worlds of the process that come to the same one.
#pragma once

#include <cstddef>
#include <deque>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "models/territory/territory.hpp"

namespace soda::models {

// The memory of a pure function, TerritoryMap::after: whole inputs are compared, and who finds
// nothing computes. Without it each world would hold a map of its own for each change. Safe to use
// from several threads.
class MapShare {
 public:
  // Equal calls return the same object as long as it is among the last kKept.
  std::shared_ptr<const TerritoryMap> after(const std::shared_ptr<const TerritoryMap>& before,
                                            std::span<const CellTransfer> transfers);

  static constexpr std::size_t kKept = 16;

 private:
  struct Change {
    std::shared_ptr<const TerritoryMap> before;  // held, so that its address means this map
    std::vector<CellTransfer> transfers;
    std::shared_ptr<const TerritoryMap> after;
  };

  std::mutex mutex_;
  std::deque<Change> changes_;  // the latest first
};

}  // namespace soda::models
