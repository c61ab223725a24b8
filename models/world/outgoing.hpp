// What a world's event sends, counted.
#pragma once

#include <utility>

#include "kernel/api/logical_process.hpp"
#include "models/messages/messages.hpp"
#include "models/messages/schedule.hpp"
#include "models/options/world_counters.hpp"

namespace soda::models {

// Lives as long as the event. Who sends counts what it is; this counts bytes.
class Outgoing {
 public:
  Outgoing(kernel::Outbox& outbox, WorldCounters& counters)
      : outbox_(outbox), counters_(counters) {}

  // `when` is later than the event.
  void send(WorldId to, kernel::VirtualTime when, MessageKind kind, kernel::Payload payload) {
    counters_.bytes_sent += payload.size();
    outbox_.send(kernel::LpId{index_of(to)}, when, static_cast<std::uint32_t>(kind),
                 std::move(payload));
  }
  // A hint (Outbox::cancel_eagerly): what was sent there before will come differently.
  void cancel_eagerly(WorldId to) { outbox_.cancel_eagerly(kernel::LpId{index_of(to)}); }
  void fault(kernel::Fault fault) { outbox_.fault(std::move(fault)); }

 private:
  kernel::Outbox& outbox_;
  WorldCounters& counters_;
};

}  // namespace soda::models
