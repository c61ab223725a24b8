// Where the messages lie that the LPs of one worker have received.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "kernel/message.hpp"

namespace soda::kernel {

// Places are numbers. The one given back last is taken first, for it is still in the cache: so
// the LPs of a worker together touch as few lines as they hold messages. One thread at a time.
class MessagePool {
 public:
  static constexpr std::uint32_t kNone = (1u << 31) - 1;  // a place needs 31 bits

  std::uint32_t put(Message&& message) {
    const std::uint32_t place = free_;
    if (place == kNone) {
      messages_.push_back(std::move(message));
      return static_cast<std::uint32_t>(messages_.size() - 1) & kNone;
    }
    Message& room = messages_[place];
    free_ = room.kind;
    std::construct_at(&room, std::move(message));  // its payload has been cleared
    return place;
  }

  void release(std::uint32_t place) {
    messages_[place].payload.clear();
    messages_[place].kind = free_;
    free_ = place;
  }

  Message& operator[](std::uint32_t place) { return messages_[place]; }
  const Message& operator[](std::uint32_t place) const { return messages_[place]; }

 private:
  std::vector<Message> messages_;
  std::uint32_t free_ = kNone;  // first unused place; the next one is in its `kind`
};

}  // namespace soda::kernel
