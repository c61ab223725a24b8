// PHOLD, the benchmark of optimistic kernels (Fujimoto 1990), made sensitive to the order of
// events: the state of an LP is a hash of all it has consumed, in order. Ordinary PHOLD cannot tell
// a kernel that breaks ties at random from a correct one, for its events are interchangeable.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "kernel/api/logical_process.hpp"

namespace soda::kernel {

// Each event is consumed by one LP and sends one other: after a whole number of ticks, or at once
// (same t, next round). Destination and delay are functions of the seed and of what the event
// carries. Probabilities in thousandths.
struct PholdOptions {
  std::uint32_t lps = 16;                 // >= 1
  std::uint32_t start_events_per_lp = 1;  // each LP sends them to itself at (0, 0)
  std::uint32_t remote_per_mille = 250;  // to an LP drawn from all, itself included; else to itself
  std::uint32_t mean_delay = 4;          // ticks, >= 1; uniform over 1 .. 2 * mean_delay - 1
  // An event goes through this many zero-delay hops to other LPs before it takes a delay.
  std::uint32_t zero_delay_rounds = 0;
  // How many events carry a word of the sender's state along, which then decides where they go: a
  // straggler changes only these messages of those that its receiver sends again.
  std::uint32_t state_carrying_per_mille = 250;
  // How many events are sent together with an idle copy, in the next slot.
  std::uint32_t doubled_per_mille = 0;
  // An LP faults whenever its state is divisible by this; 0: never.
  std::uint64_t fault_divisor = 0;
  std::uint64_t seed = 1;
};

std::vector<std::unique_ptr<LogicalProcess>> make_phold(const PholdOptions& options);

// Over the LPs in order, of (time, state) of all that they committed. `lps` from make_phold.
std::uint64_t phold_digest(std::span<const std::unique_ptr<LogicalProcess>> lps);

// The largest number of checkpoints that an LP ever held.
std::size_t phold_checkpoints(std::span<const std::unique_ptr<LogicalProcess>> lps);

}  // namespace soda::kernel
