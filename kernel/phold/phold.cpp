#include "kernel/phold/phold.hpp"

#include <algorithm>
#include <cstring>
#include <string>

#include "kernel/api/hash_mix.hpp"
#include "kernel/api/invariant.hpp"
#include "kernel/queues/sliding_vector.hpp"
#include "kernel/time_warp/copy_history.hpp"

namespace soda::kernel {
namespace {

enum Kind : std::uint32_t {
  kEvent,     // goes on
  kIdleCopy,  // is consumed, that is all
};

// More than fits into a message, so that the tests that use this model cover shared payloads.
struct EventPayload {
  std::uint64_t token;       // the event's own random word
  std::uint64_t state_word;  // of the sender, or 0
  std::uint64_t hops_left;   // zero-delay hops
};
static_assert(sizeof(EventPayload) > Payload::kInlineBytes);

Payload encode(const EventPayload& event) { return Payload::of(event); }

EventPayload decode(std::span<const std::byte> bytes) {
  EventPayload event;
  SODA_ASSERT(bytes.size() == sizeof event, bytes.size(), " bytes");
  std::memcpy(&event, bytes.data(), sizeof event);
  return event;
}

class PholdProcess final : public LogicalProcess {
 public:
  PholdProcess(LpId id, const PholdOptions& options) : id_(id), options_(options) {}

  VirtualTime next_time() const override {
    return state_.started != 0 ? kNever : VirtualTime{0, 0};
  }

  void execute(VirtualTime now, std::span<const MessageView> bag, Outbox& outbox) override {
    if (state_.started == 0) start(now, outbox);
    for (const MessageView& message : bag) consume(now, message, outbox);
    while (!executed_.empty() && executed_.back().time >= now)  // undone
      executed_.truncate(executed_.size() - 1);
    executed_.push_back({now, state_.digest});
    if (options_.fault_divisor > 0 && state_.digest % options_.fault_divisor == 0)
      outbox.fault({index_of(id_), "state " + std::to_string(state_.digest) + " is divisible by " +
                                       std::to_string(options_.fault_divisor)});
  }

  void mark(VirtualTime now) override {
    history_.mark(now, state_);
    most_checkpoints_ = std::max(most_checkpoints_, history_.size());
  }

  VirtualTime rewind(VirtualTime to) override { return history_.rewind(to, state_); }

  VirtualTime rewind_before(VirtualTime undone, VirtualTime to) override {
    return history_.rewind_before(undone, to, state_);
  }

  VirtualTime forget(VirtualTime horizon) override { return history_.forget(horizon); }

  // Every other LP leaves it to the executor to save its state.
  std::span<std::byte> state_bytes() override {
    if (index_of(id_) % 2 == 0) return {};
    return std::as_writable_bytes(std::span(&state_, 1));
  }

  void commit(VirtualTime now) override {
    std::size_t before = 0;
    while (executed_[before].time < now) ++before;
    const Executed done = executed_[before];
    SODA_ASSERT(done.time == now, "LP ", index_of(id_), " commits ", now, ", not ", done.time);
    executed_.drop_front(before + 1);
    committed_digest_ = append(committed_digest_, static_cast<std::uint64_t>(now.t));
    committed_digest_ = append(committed_digest_, now.round);
    committed_digest_ = append(committed_digest_, done.digest);
  }

  std::uint64_t digest() const override { return append(state_.digest, state_.started); }

  std::uint64_t committed_digest() const { return committed_digest_; }
  std::size_t most_checkpoints() const { return most_checkpoints_; }

 private:
  struct State {
    std::uint64_t digest = 1;
    std::uint64_t started = 0;  // 0 or 1
  };
  struct Executed {
    VirtualTime time;
    std::uint64_t digest = 0;  // after it
  };

  void start(VirtualTime now, Outbox& outbox) {
    state_.started = 1;
    for (std::uint32_t i = 0; i < options_.start_events_per_lp; ++i) {
      const std::uint64_t token = append(append(options_.seed, index_of(id_)), i);
      const VirtualTime when{now.t + delay(token), 0};
      outbox.send(id_, when, kEvent, encode(EventPayload{token, 0, options_.zero_delay_rounds}));
    }
  }

  void consume(VirtualTime now, const MessageView& message, Outbox& outbox) {
    const EventPayload event = decode(message.payload);
    for (const std::uint64_t word :
         {std::uint64_t{index_of(message.source)}, std::uint64_t{message.kind},
          std::uint64_t{message.slot}, event.token, event.state_word, event.hops_left})
      state_.digest = append(state_.digest, word);
    if (message.kind == kEvent) send_on(now, event, outbox);
  }

  // Draws are words of one chain per event: from the seed through what it carries.
  void send_on(VirtualTime now, const EventPayload& event, Outbox& outbox) {
    std::uint64_t draw = append(append(event.token, event.state_word), index_of(id_));
    const auto per_mille = [&draw] { return (draw = mix64(draw + 1)) % 1000; };
    EventPayload next{0, 0, options_.zero_delay_rounds};
    LpId destination = id_;
    if (per_mille() < options_.remote_per_mille) destination = any_lp(draw = mix64(draw + 1));
    if (per_mille() < options_.state_carrying_per_mille) next.state_word = state_.digest;
    const bool doubled = per_mille() < options_.doubled_per_mille;
    next.token = draw = mix64(draw + 1);
    VirtualTime when{now.t + delay(draw), 0};
    if (event.hops_left > 0) {
      when = {now.t, now.round + 1};
      next.hops_left = event.hops_left - 1;
    }
    outbox.send(destination, when, kEvent, encode(next));
    if (doubled) {
      outbox.send(destination, when, kIdleCopy, encode(next));
      outbox.send(destination, when, kIdleCopy, encode(next));
    }
  }

  LpId any_lp(std::uint64_t draw) const {
    return LpId{static_cast<std::uint32_t>(draw % options_.lps)};
  }

  std::int64_t delay(std::uint64_t draw) const {
    return 1 + static_cast<std::int64_t>(mix64(draw + 2) % (2 * options_.mean_delay - 1));
  }

  const LpId id_;
  const PholdOptions options_;
  State state_;
  CopyHistory<State> history_;
  SlidingVector<Executed> executed_;  // not committed yet, or executed again since
  std::uint64_t committed_digest_ = 0;
  std::size_t most_checkpoints_ = 0;
};

const PholdProcess& phold_process(const std::unique_ptr<LogicalProcess>& lp) {
  return static_cast<const PholdProcess&>(*lp);
}

}  // namespace

std::vector<std::unique_ptr<LogicalProcess>> make_phold(const PholdOptions& options) {
  SODA_ASSERT(options.lps >= 1 && options.mean_delay >= 1, "lps ", options.lps, ", mean delay ",
              options.mean_delay);
  std::vector<std::unique_ptr<LogicalProcess>> lps;
  for (std::uint32_t i = 0; i < options.lps; ++i)
    lps.push_back(std::make_unique<PholdProcess>(LpId{i}, options));
  return lps;
}

std::uint64_t phold_digest(std::span<const std::unique_ptr<LogicalProcess>> lps) {
  std::uint64_t digest = 0;
  for (const auto& lp : lps) digest = append(digest, phold_process(lp).committed_digest());
  return digest;
}

std::size_t phold_checkpoints(std::span<const std::unique_ptr<LogicalProcess>> lps) {
  std::size_t most = 0;
  for (const auto& lp : lps) most = std::max(most, phold_process(lp).most_checkpoints());
  return most;
}

}  // namespace soda::kernel
