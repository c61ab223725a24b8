#include "kernel/api/external_source.hpp"

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "kernel/api/invariant.hpp"

namespace soda::kernel {

VirtualTime ExternalSourceList::floor() {
  VirtualTime earliest = kNever;
  for (ExternalSource* const external : all_) earliest = std::min(earliest, external->floor());
  return earliest;
}

void ExternalSourceList::take(VirtualTime gvt, VirtualTime earliest, std::vector<Message>& out) {
  for (ExternalSource* const external : all_) external->take(gvt, earliest, out);
}

VirtualTime ExternalSourceDoor::hold(VirtualTime floor) const {
  return external_ ? std::min(floor, external_->floor()) : floor;
}

void ExternalSourceDoor::take(VirtualTime gvt, VirtualTime earliest, std::vector<Message>& out) {
  taken_.clear();
  external_->take(gvt, earliest, taken_);
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
    message.source = kExternalSource;
    message.version = next_version_++;
    message.anti = false;
    out.push_back(std::move(message));
  }
}

void wait_for_external() { std::this_thread::sleep_for(std::chrono::microseconds(50)); }

}  // namespace soda::kernel
