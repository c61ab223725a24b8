// Where a worker finds the messages of the other workers, and where it sleeps while there are none.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <vector>

#include "kernel/api/message.hpp"

namespace soda::kernel {

// put() and wake() from any thread, the rest by the owner. Own cache lines: inboxes lie in an
// array.
class alignas(64) Inbox {
 public:
  // Moves `messages` in and leaves it empty; one lock for all of them.
  void put(std::vector<Message>& messages) {
    const std::lock_guard lock(mutex_);
    move_all(messages, messages_);
    filled_.store(true, std::memory_order_release);
    if (sleeping_) wake_.notify_one();
  }

  // Appends everything to `messages`. Who puts something in later sees all that the owner has seen
  // before.
  void take(std::vector<Message>& messages) {
    const std::lock_guard lock(mutex_);
    move_all(messages_, messages);
    filled_.store(false, std::memory_order_release);
  }

  bool filled() const { return filled_.load(std::memory_order_acquire); }

  // Lets the owner look at its condition again.
  void wake() {
    const std::lock_guard lock(mutex_);
    wake_.notify_one();
  }

  // Sleeps until a message is here or `condition` holds, at most for `time`.
  template <class Condition>
  void sleep(std::chrono::microseconds time, const Condition& condition) {
    std::unique_lock lock(mutex_);
    sleeping_ = true;
    wake_.wait_for(lock, time, [&] { return !messages_.empty() || condition(); });
    sleeping_ = false;
  }

 private:
  std::mutex mutex_;
  std::condition_variable wake_;
  std::vector<Message> messages_;
  bool sleeping_ = false;
  std::atomic<bool> filled_{false};  // spares the owner the lock
};

}  // namespace soda::kernel
