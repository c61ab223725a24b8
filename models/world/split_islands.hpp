// Large islands of a world that several worlds solve together (split_solve.hpp).
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "models/islands/split_solve.hpp"
#include "models/world/outgoing.hpp"
#include "models/world/step_in_progress.hpp"

namespace soda::models {

// Of the step in progress, once the merge rounds are over.
class SplitIslands {
 public:
  explicit SplitIslands(StepInProgress& step) : step_(step) {}

  void start() { splits_.clear(); }
  // Whether there can be a large island with foreign bodies.
  bool may_split() const;
  // One round of all such islands at once; round 0 finds them. Whether there is another one.
  bool round(kernel::VirtualTime now, Bag bag, Outgoing& out);
  // Fills in how the own bodies of the gathered island ended, if it was split and all has been
  // received; else false.
  bool take(Bag bag);

  // Whether the bag lacks what solvers have to receive in a round; or how the blocks ended.
  bool lack_news(Bag bag) const;
  bool lack_outcome(Bag bag) const;
  std::uint64_t digest(std::uint64_t digest) const;

 private:
  void find();
  void consider(std::size_t island, const KnownBodies& known);

  StepInProgress& step_;
  std::vector<std::unique_ptr<SplitSolve>> splits_;  // ascending by label
};

}  // namespace soda::models
