// What travels between the processes of a Time Warp executor.
#pragma once

#include <compare>
#include <cstdint>
#include <iterator>
#include <tuple>
#include <utility>
#include <vector>

#include "kernel/api/logical_process.hpp"
#include "kernel/api/virtual_time.hpp"

namespace soda::kernel {

// A message id as its sender names it.
struct OutputId {
  VirtualTime time;
  LpId destination{};
  std::uint32_t kind = 0;
  std::uint32_t slot = 0;

  friend constexpr auto operator<=>(const OutputId&, const OutputId&) = default;
};

// A message has an id: (source, destination, time, kind, slot). Its newest version wins, in
// whatever order they arrive; an anti-message is a newer, empty one. So channels need no order, and
// an anti-message may overtake what it annihilates.
struct alignas(64) Message {
  Message() = default;
  Message(const OutputId& id, LpId source_, std::uint64_t version_, bool anti_, Payload payload_,
          bool first_ = false)
      : time(id.time),
        source(source_),
        destination(id.destination),
        kind(id.kind),
        slot(id.slot),
        version(version_),
        anti(anti_),
        first(first_),
        payload(std::move(payload_)) {}

  [[no_unique_address]] VirtualTime time;  // of reception
  std::uint32_t next = 0;                  // of the list that it lies in, in a pool: a place there
  LpId source{};
  LpId destination{};
  std::uint32_t kind = 0;
  std::uint32_t slot = 0;
  std::uint64_t version : 62 = 0;  // rises with every message of the source, over rollbacks
  bool anti : 1 = false;
  bool first : 1 = false;  // known to be the first version of its message; never an anti
  Payload payload;
};
static_assert(sizeof(Message) == 64, "one cache line");

// To the end of `to`; leaves `from` empty.
inline void move_all(std::vector<Message>& from, std::vector<Message>& to) {
  if (to.empty())
    to.swap(from);
  else
    to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
  from.clear();
}

// Canonical order of the messages of one destination: bags are runs of equal time.
inline auto message_id(const Message& message) {
  return std::tuple(message.time, message.source, message.kind, message.slot);
}

}  // namespace soda::kernel
