#include <algorithm>
#include <compare>
#include <map>
#include <utility>

#include "kernel/executor.hpp"
#include "kernel/invariant.hpp"

namespace soda::kernel {
namespace {

// An entry of the one queue: a message, or the wish of an LP to run by itself.
struct Event {
  VirtualTime time;
  LpId destination{};
  bool is_message = false;
  LpId source{};
  std::uint32_t kind = 0;
  std::uint32_t slot = 0;
  Payload payload;
};

// Total order without ties: entries of one (time, LP) come out together, messages among them in the
// order of the bag.
bool comes_later(const Event& a, const Event& b) {
  const auto key = [](const Event& e) {
    return std::tie(e.time, e.destination, e.is_message, e.source, e.kind, e.slot);
  };
  return key(a) > key(b);
}

// Register of a sender: messages to one (time, destination, kind) are numbered as they are sent.
struct SlotKey {
  VirtualTime time;
  LpId destination{};
  std::uint32_t kind = 0;
  friend auto operator<=>(const SlotKey&, const SlotKey&) = default;
};

class SequentialRun final : public Outbox {
 public:
  SequentialRun(std::span<const std::unique_ptr<LogicalProcess>> lps, VirtualTime end)
      : lps_(lps), end_(end), slots_(lps.size()), agenda_(lps.size(), kNever) {
    for (std::uint32_t i = 0; i < lps.size(); ++i) push_agenda(LpId{i});
  }

  RunResult run(const ProgressFn& progress) {
    while (!queue_.empty() && !result_.fault) {
      execute_time(queue_.front().time);
      if (result_.fault) break;
      commit_time();
      if (progress && (queue_.empty() || queue_.front().time.t != now_.t))
        progress(queue_.empty() ? end_ : queue_.front().time, result_.counters);
    }
    return std::move(result_);
  }

  void send(LpId destination, VirtualTime when, std::uint32_t kind, Payload payload) override {
    SODA_ASSERT(when > now_, "LP ", index_of(executing_), " executing ", now_, " sends kind ", kind,
                " to LP ", index_of(destination), " at ", when,
                ", which is not later than its own time");
    SODA_ASSERT(index_of(destination) < lps_.size(), "LP ", index_of(executing_), " at ", now_,
                " sends to LP ", index_of(destination), " of ", lps_.size());
    if (when >= end_) return;
    const std::uint32_t slot = slots_[index_of(executing_)][{when, destination, kind}]++;
    push({when, destination, true, executing_, kind, slot, std::move(payload)});
    ++result_.counters.messages;
  }

  void fault(Fault fault) override {
    if (!result_.fault) result_.fault = {now_, executing_, std::move(fault)};
  }

 private:
  // All LPs of one time execute before any is committed, for a fault of one holds back all.
  void execute_time(VirtualTime time) {
    now_ = time;
    executed_.clear();
    while (!queue_.empty() && queue_.front().time == time) {
      const LpId lp = queue_.front().destination;
      if (take_bag(lp)) execute(lp);
      if (result_.fault) return;
    }
  }

  // False if there is nothing to do: the wish of an LP that has changed its agenda since.
  bool take_bag(LpId lp) {
    bag_.clear();
    while (!queue_.empty() && queue_.front().time == now_ && queue_.front().destination == lp) {
      std::pop_heap(queue_.begin(), queue_.end(), comes_later);
      if (queue_.back().is_message)
        bag_.push_back(std::move(queue_.back()));
      else if (agenda_[index_of(lp)] == now_)
        agenda_[index_of(lp)] = kNever;
      queue_.pop_back();
    }
    return !bag_.empty() || lps_[index_of(lp)]->next_time() == now_;
  }

  void execute(LpId lp) {
    executing_ = lp;
    views_.clear();
    for (const Event& event : bag_) {
      views_.push_back({event.source, event.kind, event.slot, event.payload.bytes()});
    }
    auto& slots = slots_[index_of(lp)];
    slots.erase(slots.begin(), slots.upper_bound({now_, LpId{~0u}, ~0u}));
    lps_[index_of(lp)]->execute(now_, views_, *this);
    ++result_.counters.executed;
    executed_.push_back(lp);
    push_agenda(lp);
  }

  void commit_time() {
    for (const LpId lp : executed_) lps_[index_of(lp)]->commit(now_);
    result_.counters.committed += executed_.size();
  }

  void push_agenda(LpId lp) {
    const VirtualTime next = lps_[index_of(lp)]->next_time();
    SODA_ASSERT(result_.counters.executed == 0 || next > now_, "agenda of LP ", index_of(lp),
                " after executing ", now_, " is ", next);
    if (next >= end_ || next == agenda_[index_of(lp)]) return;
    agenda_[index_of(lp)] = next;
    push({next, lp, false, {}, 0, 0, {}});
  }

  void push(Event event) {
    queue_.push_back(std::move(event));
    std::push_heap(queue_.begin(), queue_.end(), comes_later);
  }

  std::span<const std::unique_ptr<LogicalProcess>> lps_;
  const VirtualTime end_;
  std::vector<Event> queue_;                             // a heap, earliest in front
  std::vector<std::map<SlotKey, std::uint32_t>> slots_;  // of each LP, what is still to come
  std::vector<VirtualTime> agenda_;  // of each LP, the wish queued last; kNever if none
  VirtualTime now_;
  LpId executing_{};
  std::vector<Event> bag_;
  std::vector<MessageView> views_;
  std::vector<LpId> executed_;  // at now_, ascending
  RunResult result_;
};

}  // namespace

RunResult run_sequential(std::span<const std::unique_ptr<LogicalProcess>> lps, VirtualTime end,
                         const ProgressFn& progress) {
  return SequentialRun(lps, end).run(progress);
}

}  // namespace soda::kernel
