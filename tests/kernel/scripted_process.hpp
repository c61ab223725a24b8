// An LP whose behaviour is a lambda, with copied state, for scripts that a reader can follow.
#pragma once

#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "kernel/api/logical_process.hpp"
#include "kernel/time_warp/copy_history.hpp"

namespace soda::kernel {

inline Payload number(std::uint64_t value) { return Payload::of(value); }

inline std::uint64_t number_in(std::span<const std::byte> bytes) {
  std::uint64_t value = 0;
  if (bytes.size() == sizeof value) std::memcpy(&value, bytes.data(), sizeof value);
  return value;
}

class ScriptedProcess final : public LogicalProcess {
 public:
  using Handler = std::function<void(ScriptedProcess& self, VirtualTime now,
                                     std::span<const MessageView> bag, Outbox& outbox)>;
  struct Script {
    std::vector<VirtualTime> future_events = {};  // ascending
    Handler on_execute = {};
    std::int64_t mark_every_t = 0;     // 0: at every time; else only at (n * mark_every_t, 0)
    bool waits_for_a_message = false;  // gating: with an empty bag it would rather wait
    std::function<bool(ScriptedProcess& self, VirtualTime now, std::span<const MessageView> bag)>
        on_absorb = {};
  };

  explicit ScriptedProcess(Script script) : script_(std::move(script)) {}

  VirtualTime next_time() const override {
    return state.future_events_done < script_.future_events.size()
               ? script_.future_events[state.future_events_done]
               : kNever;
  }

  void execute(VirtualTime now, std::span<const MessageView> bag, Outbox& outbox) override {
    while (state.future_events_done < script_.future_events.size() &&
           script_.future_events[state.future_events_done] <= now)
      ++state.future_events_done;
    for (const MessageView& message : bag) state.sum += number_in(message.payload);
    executions.push_back(now);
    if (script_.on_execute) script_.on_execute(*this, now, bag, outbox);
  }

  void mark(VirtualTime now) override {
    const bool due =
        script_.mark_every_t == 0 || (now.t % script_.mark_every_t == 0 && now.round == 0);
    if (due || history.size() == 0) history.mark(now, state);
  }
  VirtualTime rewind(VirtualTime to) override {
    rewinds.push_back(to);
    return history.rewind(to, state);
  }
  VirtualTime forget(VirtualTime horizon) override { return history.forget(horizon); }
  bool absorb(VirtualTime now, std::span<const MessageView> bag) override {
    return script_.on_absorb(*this, now, bag);
  }
  bool absorbs() const override { return script_.on_absorb != nullptr; }
  void commit(VirtualTime now) override { commits.push_back(now); }
  bool waits_for_dependencies() const override { return script_.waits_for_a_message; }
  bool holds(VirtualTime, std::span<const MessageView> bag) const override { return bag.empty(); }

  struct State {
    std::size_t future_events_done = 0;
    std::uint64_t sum = 0;  // of the numbers received
  };
  State state;
  CopyHistory<State> history;
  // What happened, over rollbacks.
  std::vector<VirtualTime> executions;
  std::vector<VirtualTime> rewinds;
  std::vector<VirtualTime> commits;

 private:
  const Script script_;
};

}  // namespace soda::kernel
