// The phases of a physics step and their places in virtual time: the only file that knows both.
#pragma once

#include <cstdint>

#include "kernel/api/virtual_time.hpp"

namespace soda::models {

// In this order within a pass of step k; a step begins once, and finishes once, after all passes.
// See docs/step-protocol.md for what happens in each and who sends what.
enum class Phase : std::uint32_t {
  kBegin = 0,
  kBorderTraversal = 2,
  kPairs = 3,
  kSync = 4,   // has merge rounds 0, 1, 2, ...
  kSplit = 5,  // solvers of large islands exchange borders in rounds 0, 1, 2, ..., then their work
  kSolve = 6,
  kFinish = 7,
};

// Message types, and when they arrive.
enum class MessageKind : std::uint32_t {
  kMigrants = 0,   // at kBegin: bodies whose centre entered the receiver's territory
  kGhosts = 1,     // at kBorderTraversal: bodies whose swept box covers a cell of the receiver
  kFragments = 2,  // at kSync round 0: cross-owner contacts, from a world that tested the pair
  kRecords = 3,    // at kSync round >= 1: records of a mixed island
  kInputs = 4,     // at kBegin, from outside: what the user does, to all worlds
  kTransfers = 5,  // at kBegin, from outside, to every world: cells that change hands
  kBorders = 6,    // at kSplit round >= 1: velocities at the border of a block of a large island
  kWork = 7,       // at kSplit, in the round after the last sweep: work of the blocks' impulses
  kBlocks = 8,     // at kSolve: how its blocks ended
  kSent = 9,  // from pass 1 on: bodies that impacts have sent on, at kBorderTraversal from their
              // owner, at kPairs from a world that passes them on
};

inline constexpr std::uint32_t kPassShift = 20, kPhaseShift = 16;
inline constexpr std::uint32_t kLastPass = (1u << (32 - kPassShift)) - 1;

constexpr kernel::VirtualTime time_of(std::int64_t step, Phase phase, std::uint32_t round = 0,
                                      std::uint32_t pass = 0) {
  if (phase == Phase::kFinish) pass = kLastPass;
  return {step, pass << kPassShift | static_cast<std::uint32_t>(phase) << kPhaseShift | round};
}
constexpr Phase phase_of(kernel::VirtualTime time) {
  return static_cast<Phase>(time.round >> kPhaseShift & ((1u << (kPassShift - kPhaseShift)) - 1));
}
constexpr std::uint32_t pass_of(kernel::VirtualTime time) { return time.round >> kPassShift; }
// How many steps are over when everything before `time` is done.
constexpr std::int64_t steps_before(kernel::VirtualTime time) {
  if (time.t < 0) return 0;
  return time > time_of(time.t, Phase::kFinish) ? time.t + 1 : time.t;
}
// Of the phases that have rounds.
constexpr std::uint32_t merge_round_of(kernel::VirtualTime time) {
  return time.round & ((1u << kPhaseShift) - 1);
}

}  // namespace soda::models
