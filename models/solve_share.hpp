// Sharing the solve of a mixed island between the worlds of one process.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "kernel/logical_process.hpp"
#include "physics/advance.hpp"

namespace soda::models {

// The outcome of advancing one island.
struct SolvedIsland {
  std::vector<physics::BodyState> states;  // in the island's body order
  physics::IslandReport report;
  std::vector<physics::AdvanceFault> faults;
};

// Remembers solved islands by their exact input bytes, so that every participating world but the
// first finds its answer here. A pure function's memory: whether and when an entry is found changes
// cost only. Safe for use from all worker threads.
class SolveShare {
 public:
  // `keep_steps` >= 1: solves older than that many steps before the newest one are dropped.
  explicit SolveShare(std::int64_t keep_steps) : keep_steps_(keep_steps) {}

  // The stored outcome for exactly this input, or null.
  std::shared_ptr<const SolvedIsland> find(std::span<const std::byte> input) const;
  void store(std::int64_t step, kernel::Bytes input, std::shared_ptr<const SolvedIsland> solved);

 private:
  struct Entry {
    kernel::Bytes input;
    std::shared_ptr<const SolvedIsland> solved;
  };
  using Key = std::array<std::uint64_t, 2>;  // XXH3-128 of the input

  mutable std::mutex mutex_;
  std::int64_t keep_steps_;
  std::map<Key, Entry> entries_;
  std::multimap<std::int64_t, Key> by_step_;
};

}  // namespace soda::models
