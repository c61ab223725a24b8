// What came of extrapolations: a count beside the simulation, never part of a world's state.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "models/islands/island_merge.hpp"
#include "models/messages/messages.hpp"
#include "models/options/world_counters.hpp"

namespace soda::models {

// Of one world. A *foreign contact* is one that has two owners, found by the world that tests the
// pair. Bookkeeping of a step ends when it is committed.
class ExtrapolationAudit {
 public:
  // The ghosts of `owner` are extrapolated in this step; replaces an earlier extrapolation.
  void note_extrapolated(std::int64_t step, WorldId owner, std::span<const Ghost> ghosts);
  // They have come. What had been extrapolated of them, if anything, is counted, once.
  void note_news(std::int64_t step, WorldId owner, std::span<const Ghost> ghosts,
                 WorldCounters& counters);
  // The foreign contacts of one execution of the step; the last one before commit() is the
  // committed one.
  void note_contacts(std::int64_t step, std::set<RecordKey> contacts);
  void commit(std::int64_t step, WorldCounters& counters);

 private:
  struct Found {
    std::set<RecordKey> in_any, in_all, in_last;  // executions of a step
  };
  std::map<std::pair<std::int64_t, WorldId>, std::vector<Ghost>> extrapolated_;
  std::map<std::int64_t, Found> found_;
};

}  // namespace soda::models
