#include "kernel/api/outside.hpp"

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "kernel/api/invariant.hpp"

namespace soda::kernel {

VirtualTime OutsideList::floor() {
  VirtualTime earliest = kNever;
  for (Outside* const outside : all_) earliest = std::min(earliest, outside->floor());
  return earliest;
}

void OutsideList::take(VirtualTime gvt, VirtualTime earliest, std::vector<Message>& out) {
  for (Outside* const outside : all_) outside->take(gvt, earliest, out);
}

VirtualTime OutsideDoor::hold(VirtualTime floor) const {
  return outside_ ? std::min(floor, outside_->floor()) : floor;
}

void OutsideDoor::take(VirtualTime gvt, VirtualTime earliest, std::vector<Message>& out) {
  taken_.clear();
  outside_->take(gvt, earliest, taken_);
  sent_.erase(sent_.begin(), sent_.lower_bound({gvt, LpId{0}, 0, 0}));
  for (Message& message : taken_) {
    SODA_ASSERT(message.time >= earliest && message.time > kBeginning &&
                    index_of(message.destination) < lp_count_,
                "from outside, to LP ", index_of(message.destination), " of ", lp_count_, " at ",
                message.time, "; the earliest time is ", earliest);
    if (message.time >= end_) continue;
    const bool is_new =
        sent_.insert({message.time, message.destination, message.kind, message.slot}).second;
    SODA_ASSERT(is_new, "from outside, twice to LP ", index_of(message.destination), " at ",
                message.time, ", kind ", message.kind, ", slot ", message.slot);
    message.source = kOutside;
    message.incarnation = next_incarnation_++;
    message.anti = false;
    out.push_back(std::move(message));
  }
}

void wait_for_outside() { std::this_thread::sleep_for(std::chrono::microseconds(50)); }

}  // namespace soda::kernel
