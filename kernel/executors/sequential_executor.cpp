#include <algorithm>
#include <tuple>
#include <utility>

#include "kernel/api/executor.hpp"
#include "kernel/api/invariant.hpp"
#include "kernel/queues/calendar_queue.hpp"

namespace soda::kernel {
namespace {

// What an entry of the one queue holds beside its time and LP: a message, or the wish of the LP to
// run by itself.
struct Entry {
  static constexpr std::uint64_t kWish = ~std::uint64_t{0};

  std::uint64_t number = kWish;  // of the message, in the order of sending; from outside, its slot
  LpId source{};
  std::uint32_t kind = 0;
  Payload payload;

  bool is_message() const { return number != kWish; }
};

// Order of the bag. A sender numbers its messages to one (LP, time, kind) as it sends them, so
// their slots are their ranks by number.
bool comes_first(const Entry& a, const Entry& b) {
  return std::tie(a.source, a.kind, a.number) < std::tie(b.source, b.kind, b.number);
}

using Queue = CalendarQueue<Entry>;

class SequentialRun final : public Outbox {
 public:
  SequentialRun(std::span<const std::unique_ptr<LogicalProcess>> lps, VirtualTime end,
                ExternalSource* external, const StopRequest* stop, const Recording& recording)
      : lps_(lps),
        end_(end),
        external_(external, lps.size(), end),
        stop_(stop),
        records_(recording.kind_of != nullptr),
        recorder_(recording, 0),
        future_events_(lps.size(), kNever) {
    for (std::uint32_t i = 0; i < lps.size(); ++i) {
      const VirtualTime first = lps[i]->next_time();
      SODA_ASSERT(first > kBeginning, "future event list of LP ", i, " begins at ", first,
                  ", which is earlier than every time that can be executed");
      push_future_event(LpId{i}, first);
    }
  }

  RunResult run(const ProgressFn& progress) {
    if (external_.exists()) ask_external(true);
    while (!queue_.empty()) {
      execute_time(next_time());
      if (result_.fault) break;
      commit_time();
      const bool t_ends = next_or_end().t != now_.t;
      if (external_.exists() && (t_ends || next_or_end() >= open_until_)) ask_external(t_ends);
      if (progress && (queue_.empty() || next_time().t != now_.t))
        progress(queue_.empty() ? end_ : next_time(), result_.counters);
      if (next_or_end() < end_ && next_time().t != now_.t && stop_wanted() != 0) {
        result_.stopped = stop_wanted();
        result_.stopped_at = next_time();
        break;
      }
    }
    result_.kinds = recorder_.counts();
    recorder_.flush(true);
    return std::move(result_);
  }

  void send(LpId destination, VirtualTime when, std::uint32_t kind, Payload payload) override {
    SODA_ASSERT(when > now_, "LP ", index_of(executing_), " executing ", now_, " sends kind ", kind,
                " to LP ", index_of(destination), " at ", when,
                ", which is not later than its own time");
    SODA_ASSERT(index_of(destination) < lps_.size(), "LP ", index_of(executing_), " at ", now_,
                " sends to LP ", index_of(destination), " of ", lps_.size());
    if (when >= end_) return;
    if (records_) [[unlikely]]
      recorder_.sent(
          {{when, destination, kind, 0}, executing_, result_.counters.messages, false, {}}, now_);
    queue_.push({when.t, when.round, index_of(destination)}, result_.counters.messages++,
                executing_, kind, std::move(payload));
  }

  void fault(Fault fault) override {
    if (!std::exchange(tells_fault_, true))
      keep_first(CommittedFault{now_, executing_, std::move(fault)}, result_.fault);
  }

 private:
  VirtualTime next_time() {
    const Queue::Key& key = queue_.top();
    return {key.t, key.round};
  }

  VirtualTime next_or_end() { return queue_.empty() ? end_ : next_time(); }

  std::uint32_t stop_wanted() const {
    return stop_ != nullptr ? stop_->load(std::memory_order_relaxed) : 0;
  }

  // Until what comes next can be executed: nothing may come from outside any more at that time; or,
  // if a t has ended, until the run is to stop there. Everything before it is irrevocable already.
  void ask_external(bool t_ends) {
    while (true) {
      const VirtualTime gvt = external_.hold(next_or_end());
      if (gvt >= end_) return;
      external_messages_.clear();
      external_.take(gvt, gvt, external_messages_);
      result_.counters.messages += external_messages_.size();
      for (Message& message : external_messages_)
        queue_.push({message.time.t, message.time.round, index_of(message.destination)},
                    std::uint64_t{message.slot}, kExternalSource, message.kind,
                    std::move(message.payload));
      open_until_ = external_.hold(kNever);
      if (next_or_end() < open_until_ || open_until_ >= end_) return;
      if (t_ends && stop_wanted() != 0) return;
      wait_for_external();
    }
  }

  // All LPs of one time execute before any is committed, for a fault of one holds back all, and of
  // several one counts.
  void execute_time(VirtualTime time) {
    SODA_ASSERT(time > now_, "the queue goes back from ", now_, " to ", time);
    now_ = time;
    executed_.clear();
    do {
      const LpId lp{queue_.top().lp};
      take_bag(lp);
      // Nothing to do: the wish of an LP that has changed its future event list since.
      if (bag_.empty() && lps_[index_of(lp)]->next_time() != now_) continue;
      execute(lp);
    } while (!queue_.empty() && next_time() == time);
  }

  void take_bag(LpId lp) {
    const Queue::Key key{now_.t, now_.round, index_of(lp)};
    bag_.clear();
    do {
      queue_.pop(bag_);
      if (bag_.back().is_message()) continue;
      bag_.pop_back();
      if (future_events_[index_of(lp)] == now_) future_events_[index_of(lp)] = kNever;
    } while (!queue_.empty() && queue_.top() == key);
    if (bag_.size() > 1) std::sort(bag_.begin(), bag_.end(), comes_first);
  }

  void execute(LpId lp) {
    executing_ = lp;
    LogicalProcess& process = *lps_[index_of(lp)];
    views_.clear();
    for (const Entry& entry : bag_) view(entry);
    if (!queue_.empty()) __builtin_prefetch(lps_[queue_.top().lp].get());  // likely the next
    tells_fault_ = false;
    const std::int64_t began_ns = records_ ? recorder_.now_ns() : 0;
    try {
      process.execute(now_, views_, *this);
    } catch (...) {
      // An exception is a fault of subject 0. Of what one execution tells, the first counts.
      const bool counts = !tells_fault_ && (!result_.fault || result_.fault->fault.subject > 0);
      if (counts) throw;
      return;
    }
    ++result_.counters.executed;
    if (records_) [[unlikely]]
      recorder_.executed(lp, now_, began_ns, false);
    executed_.push_back(lp);
    push_future_event(lp, process.next_time());
  }

  void view(const Entry& entry) {
    const bool same_id =
        !views_.empty() && views_.back().source == entry.source && views_.back().kind == entry.kind;
    std::uint32_t slot = same_id ? views_.back().slot + 1 : 0;
    if (entry.source == kExternalSource) slot = static_cast<std::uint32_t>(entry.number);
    views_.push_back({entry.source, entry.kind, slot, entry.payload.bytes()});
  }

  void commit_time() {
    for (const LpId lp : executed_) {
      lps_[index_of(lp)]->commit(now_);
      if (records_) [[unlikely]]
        recorder_.committed(lp, now_);
    }
    result_.counters.committed += executed_.size();
  }

  void push_future_event(LpId lp, VirtualTime next) {
    SODA_ASSERT(result_.counters.executed == 0 || next > now_, "future event list of LP ",
                index_of(lp), " after executing ", now_, " is ", next);
    if (next >= end_ || next == future_events_[index_of(lp)]) return;
    future_events_[index_of(lp)] = next;
    queue_.push({next.t, next.round, index_of(lp)});
  }

  std::span<const std::unique_ptr<LogicalProcess>> lps_;
  const VirtualTime end_;
  ExternalSourceDoor external_;
  const StopRequest* const stop_;
  const bool records_;
  EventRecorder recorder_;
  VirtualTime open_until_ = kNever;  // the floor of the external source when it was last asked
  std::vector<Message> external_messages_;  // scratch
  Queue queue_;
  std::vector<VirtualTime> future_events_;  // of each LP, the wish queued last; kNever if none
  VirtualTime now_ = kBeginning;
  LpId executing_{};
  bool tells_fault_ = false;  // in this execution
  std::vector<Entry> bag_;
  std::vector<MessageView> views_;
  std::vector<LpId> executed_;  // at now_, ascending
  RunResult result_;
};

}  // namespace

RunResult run_sequential(std::span<const std::unique_ptr<LogicalProcess>> lps, VirtualTime end,
                         const ProgressFn& progress, ExternalSource* external,
                         const StopRequest* stop, const Recording& recording) {
  return SequentialRun(lps, end, external, stop, recording).run(progress);
}

}  // namespace soda::kernel
