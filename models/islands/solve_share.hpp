// Sharing the solve of a mixed island between the worlds of one process.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

#include "kernel/api/logical_process.hpp"
#include "physics/model/body_state.hpp"
#include "physics/model/island_report.hpp"
#include "physics/solvers/split_solver.hpp"

namespace soda::models {

// The outcome of advancing one island.
struct SolvedIsland {
  std::vector<physics::BodyState> states;  // in the island's body order
  physics::IslandReport report;
  std::vector<physics::AdvanceFault> faults;
};

// How a range of blocks of a large island was solved: what was sent and received after each stage
// and in the end.
struct SolvedBlocks {
  struct Stage {
    kernel::Payload to_before, to_behind;
    std::vector<physics::BorderBody> from_before, from_behind;
  };
  std::vector<Stage> stages;
  std::vector<physics::StepWork> work;  // by block: of all impulses, of which `share` was allowed
  double share = 1.0;
  std::vector<std::vector<physics::BodyState>> moved;  // by block, in the order of its bodies
  std::vector<physics::BlockReport> reports;           // by block
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

  // The same for blocks [first, last) of the island. What was received is part of their input:
  // whoever takes them compares it.
  using Range = std::pair<std::uint32_t, std::uint32_t>;
  std::shared_ptr<const SolvedBlocks> find_blocks(std::span<const std::byte> input,
                                                  Range range) const;
  void store_blocks(std::int64_t step, std::span<const std::byte> input, Range range,
                    std::shared_ptr<const SolvedBlocks> solved);

 private:
  struct Entry {
    kernel::Bytes input;
    std::shared_ptr<const SolvedIsland> solved;
    std::map<Range, std::shared_ptr<const SolvedBlocks>> blocks;
  };
  using Key = std::array<std::uint64_t, 2>;  // XXH3-128 of the input

  Entry* entry_for(std::int64_t step, std::span<const std::byte> input);

  mutable std::mutex mutex_;
  std::int64_t keep_steps_;
  std::map<Key, Entry> entries_;
  std::multimap<std::int64_t, Key> by_step_;
};

}  // namespace soda::models
