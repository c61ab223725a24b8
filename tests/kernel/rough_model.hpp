// A PHOLD that meets what is rare: ties, zero delays, several messages of one id.
#pragma once

#include "kernel/phold/phold.hpp"

namespace soda::kernel {

// Ties (integer delays of 1 .. 7 ticks), zero-delay rounds, slots, payloads that rollbacks change.
inline PholdOptions rough_model(std::uint64_t seed) {
  return {.lps = 12,
          .start_events_per_lp = 2,
          .remote_per_mille = 500,
          .mean_delay = 4,
          .zero_delay_rounds = static_cast<std::uint32_t>(seed % 4),
          .state_carrying_per_mille = 250,
          .doubled_per_mille = 100,
          .seed = seed};
}

}  // namespace soda::kernel
