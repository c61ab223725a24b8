// Where the messages lie that the LPs of one worker have received.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "kernel/api/message.hpp"

namespace soda::kernel {

// Places are numbers. The one given back last is taken first, for it is still in the cache: so
// the LPs of a worker together touch as few lines as they hold messages. Who looks at a payload
// while messages are put here (an LP that sends while it reads its bag) may go on: what the pool
// has outgrown is kept. One thread at a time.
class MessagePool {
 public:
  static constexpr std::uint32_t kNone = (1u << 31) - 1;  // a place needs 31 bits

  std::uint32_t put(Message&& message) { return emplace(std::move(message)); }

  // Constructed in place. Arguments must not refer to what lies here.
  template <class... Arguments>
  std::uint32_t emplace(Arguments&&... arguments) {
    const std::uint32_t place = free_;
    if (place == kNone) [[unlikely]] {
      if (messages_.size() == messages_.capacity()) grow();
      messages_.emplace_back(std::forward<Arguments>(arguments)...);
      return static_cast<std::uint32_t>(messages_.size() - 1) & kNone;
    }
    Message& room = messages_[place];
    free_ = room.next;
    std::construct_at(&room, std::forward<Arguments>(arguments)...);  // its payload was cleared
    return place;
  }

  void release(std::uint32_t place) {
    messages_[place].payload.clear();
    messages_[place].next = free_;
    free_ = place;
  }

  Message& operator[](std::uint32_t place) { return messages_[place]; }
  const Message& operator[](std::uint32_t place) const { return messages_[place]; }

 private:
  // Moving a payload leaves its bytes where they were.
  void grow() {
    std::vector<Message> larger;
    larger.reserve(std::max<std::size_t>(64, 2 * messages_.size()));
    for (Message& message : messages_) larger.push_back(std::move(message));
    outgrown_.push_back(std::exchange(messages_, std::move(larger)));
  }

  std::vector<Message> messages_;
  std::vector<std::vector<Message>> outgrown_;  // together no more than messages_
  std::uint32_t free_ = kNone;                  // first unused place; the next one is in its `next`
};

}  // namespace soda::kernel
