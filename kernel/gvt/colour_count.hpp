// GVT over ranks that never stop together: Mattern's two cuts, by counting coloured messages.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "kernel/api/invariant.hpp"
#include "kernel/api/transport.hpp"

namespace soda::kernel {

// One rank's part (Mattern, J. Parallel Distrib. Comput. 18, 1993). A computation begins at each
// rank when it contributes for the first time: from then on its messages have the new colour. It
// contributes again, with newer numbers, until the sum over all ranks says that no message of the
// old colour is in transit any more. Then the minimum of the floors is GVT: what a rank sent after
// its floor was taken has the new colour, and the earliest of those is part of its floor.
class ColourCount {
 public:
  std::uint8_t colour() const { return colour_; }

  // Whether the next contribution begins a computation.
  bool begins() const { return begins_; }

  // A message left, with colour().
  void note_sent(VirtualTime time) {
    ++balance_[colour_];
    earliest_sent_ = std::min(earliest_sent_, time);
  }

  void note_received(std::uint8_t colour) { --balance_[colour]; }

  // `floor` holds for all LPs and for all messages that have been received; everything that was to
  // be sent has been noted.
  GvtEstimate contribution(VirtualTime floor) {
    SODA_ASSERT(!contributed_, "two contributions to one reduction");
    contributed_ = true;
    if (begins_) {
      begins_ = false;
      colour_ ^= 1;
      earliest_sent_ = kNever;
    }
    const VirtualTime least = std::min(floor, earliest_sent_);
    GvtEstimate estimate;
    estimate.in_transit = balance_[colour_ ^ 1];
    estimate.floor_t = least.t;
    estimate.floor_round = least.round;
    return estimate;
  }

  // Whether the sum of all contributions gives GVT: then sum.floor().
  bool conclude(const GvtEstimate& sum) {
    SODA_ASSERT(contributed_ && sum.in_transit >= 0, sum.in_transit, " messages in transit");
    contributed_ = false;
    begins_ = sum.in_transit == 0;
    return begins_;
  }

 private:
  std::uint8_t colour_ = 0;
  // Sent less received, of each colour, since the run began.
  std::array<std::int64_t, 2> balance_{};
  VirtualTime earliest_sent_ = kNever;  // of the newer colour
  bool begins_ = true;
  bool contributed_ = false;  // and its reduction is not concluded
};

}  // namespace soda::kernel
