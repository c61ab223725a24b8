// What a worker executes: what has come in time, in order and kept in the journal; what its
// schedule says; and how much of it between two looks at the inbox.
#include <algorithm>

#include "kernel/executors/worker.hpp"

namespace soda::kernel {
namespace {

using std::chrono::microseconds;

// Bags between two looks at the inbox: many tiny ones (the look costs as much as one), or a single
// one of a heavy model, whose messages must not wait for the next.
constexpr std::size_t kLongestBatch = 64;
constexpr microseconds kShortBatch{10};
constexpr microseconds kLongBatch{40};

// A round has a cost of its own, but what is collected late has left the cache. What bags that take
// long leave behind fills the cache sooner: so many us are enough, too.
constexpr std::size_t kBagsPerRound = 1024;
constexpr microseconds kLongestRound{10'000};
// A worker that is alone knows GVT without, and collects by itself.
constexpr std::size_t kBagsPerRoundAlone = 65536;

// What is collected is fetched so many entries before: between rounds it can have left the cache.
constexpr std::uint64_t kEntriesAhead = 4;

}  // namespace

// Lowest floor first: what is furthest behind is least likely to be undone, and holds GVT back.
inline std::uint32_t Worker::pick() {
  if (shuffles()) {
    ++effects_.counters.shuffled;
    for (int attempt = 0; attempt < 4; ++attempt) {
      const auto own = static_cast<std::uint32_t>(random_.below(schedule_.size()));
      if (schedule_.time_of(own) < open_until_) return own;
    }
  }
  return schedule_.top();
}

std::size_t Worker::bags_per_round() const {
  return is_alone_ ? kBagsPerRoundAlone : kBagsPerRound;
}

void Worker::execute_batch() {
  const auto start = std::chrono::steady_clock::now();
  if (follows_work()) open_until_ = end_of_window();
  std::size_t executed = 0;
  while (executed < batch_size_ && can_execute()) {
    const std::size_t in_order = execute_arrived(batch_size_ - executed);
    executed += in_order;
    if (in_order > 0) continue;
    if (schedule_.top_time() < open_until_) execute_one(pick());
    ++executed;
  }
  executed_since_report_ += executed;
  effects_.counters.batches += executed > 1;
  if (knows_gvt()) {
    effects_.counters.alone += executed;
    if (journal_.size() > 0) {
      gvt_ = std::min(earliest(), end_);  // all of the journal is earlier
      collect_journal();
    }
  }
  const auto now = std::chrono::steady_clock::now();
  batch_took_ = now - start;
  adapt_batch(executed);
  // A seed makes a run on one thread reproducible: then the clock decides nothing.
  const bool is_late = shuffles() ? random_.below(32) == 0 : now - last_report_ >= kLongestRound;
  if (executed_since_report_ >= bags_per_round())
    request_round(&Counters::full_rounds);
  else if (is_late)
    request_round(&Counters::timed_rounds);
}

void Worker::execute_one(std::uint32_t own) {
  TimeWarpProcess& process = processes_[own];
  if (knows_gvt()) gvt_ = process.floor();
  note_lead(process.next_time().t);
  const TimeWarpProcess* const next =
      schedule_.top_time() < end_ ? &processes_[schedule_.top()] : nullptr;
  if (next) next->prefetch();
  process.collect(gvt_, effects_);
  executing_ = own;
  process.execute(effects_);
  effects_.revalidated.clear();
  note_uncommitted(own);
  if (next) next->prefetch_history();
  route_outgoing();
  executing_ = kNobody;
  refresh(own);
  if (!touched_.empty()) settle_receivers();
}

void Worker::adapt_batch(std::size_t executed) {
  if (shuffles())
    batch_size_ = 1 + random_.below(8);
  else if (batch_took_ > kLongBatch)
    batch_size_ = std::max<std::size_t>(batch_size_ / 2, 1);
  else if (batch_took_ < kShortBatch && executed == batch_size_)
    batch_size_ = std::min(batch_size_ * 2, kLongestBatch);
}

// The one that comes next; if it comes too late, the LP gets it and settles. True if all that it
// has changed is the calendar.
[[gnu::always_inline]] inline bool Worker::execute_bag(VirtualTime now) {
  const LpId lp = calendar_.top_lp();
  const std::uint32_t own = index_of(lp) - first_lp_;
  TimeWarpProcess& process = processes_[own];
  std::uint32_t first = calendar_.pop();
  std::uint32_t inputs = 1;
  if (calendar_.has_more(now, lp)) [[unlikely]] {
    first = take_rest(now, lp, first);
    inputs = static_cast<std::uint32_t>(places_.size());
  } else {
    pool_[first].next = MessagePool::kNone;
  }
  if (!process.takes_in_order(now)) [[unlikely]] {
    deliver_list(own, first);
    return false;
  }
  note_lead(now.t);
  process.collect(gvt_, effects_);
  const TimeWarpProcess* const next = calendar_.top_time() != kNever
                                          ? &processes_[index_of(calendar_.top_lp()) - first_lp_]
                                          : nullptr;
  if (next) next->prefetch();
  const bool changes = process.execute_in_order(now, first, inputs, effects_);
  if (next) next->prefetch_in_order();
  if (!changes && effects_.outgoing.empty()) return true;
  route_outgoing();
  if (changes) refresh(own);
  if (!touched_.empty()) settle_receivers();
  return false;
}

// Whether `now`, the top of the calendar, comes before anything in the schedule. Of a time that
// both have for an LP, the messages are delivered first, and then it is in the schedule.
bool Worker::precedes_schedule(VirtualTime now) const {
  const VirtualTime scheduled = schedule_.top_time();
  return now < scheduled ||
         (now == scheduled && index_of(calendar_.top_lp()) - first_lp_ <= schedule_.top());
}

// Bags that come before anything in the schedule, at most `most` of them; returns how many.
std::size_t Worker::execute_arrived(std::size_t most) {
  std::size_t executed = 0;
  bool knows = knows_gvt();
  VirtualTime limit = std::min(open_until_, schedule_.top_time());
  for (; executed < most; ++executed) {
    const VirtualTime now = calendar_.top_time();
    if (now >= limit && (now >= open_until_ || !precedes_schedule(now))) break;
    if (shuffles() && random_.below(2) == 0) break;
    if (knows) gvt_ = now;
    if (execute_bag(now)) continue;
    knows = knows_gvt();
    limit = std::min(open_until_, schedule_.top_time());
  }
  return executed;
}

// The other messages of a bag, in canonical order; returns the first.
std::uint32_t Worker::take_rest(VirtualTime now, LpId lp, std::uint32_t first) {
  places_.assign(1, first);
  while (calendar_.has_more(now, lp)) places_.push_back(calendar_.pop());
  std::sort(places_.begin(), places_.end(), [this](std::uint32_t a, std::uint32_t b) {
    return message_id(pool_[a]) < message_id(pool_[b]);
  });
  for (std::size_t i = 0; i < places_.size(); ++i)
    pool_[places_[i]].next = i + 1 < places_.size() ? places_[i + 1] : MessagePool::kNone;
  return places_.front();
}

void Worker::deliver_list(std::uint32_t own, std::uint32_t first) {
  for (std::uint32_t place = first; place != MessagePool::kNone;) {
    const std::uint32_t next = pool_[place].next;
    Message message = std::move(pool_[place]);
    pool_.release(place);
    deliver_now(own, std::move(message));
    place = next;
  }
  settle_receivers();
}

// What GVT has passed, up to the first entry that it has not. What was executed again after a
// rollback, and so lies behind that although it is earlier, waits for its turn: of what a worker
// has executed ahead of the others, nothing is looked at twice.
void Worker::collect_journal() {
  const std::uint64_t end = journal_.next_number();
  std::uint64_t number = journal_.first_number();
  for (; number < end; ++number) {
    const Journal::Entry& entry = journal_[number];
    if (entry.lp == nullptr) continue;
    if (entry.time() >= gvt_) break;
    if (number + kEntriesAhead < end) {
      const Journal::Entry& ahead = journal_[number + kEntriesAhead];
      if (ahead.lp != nullptr) ahead.lp->prefetch();
      __builtin_prefetch(&pool_[ahead.first_input]);
    }
    entry.lp->collect_in_order(number, gvt_, effects_);
  }
  journal_.drop_first(number - journal_.first_number());
}

void Worker::take_back_journal() {
  for (std::uint64_t number = journal_.first_number(); number < journal_.next_number(); ++number) {
    TimeWarpProcess* const process = journal_[number].lp;
    if (process == nullptr) continue;
    process->take_back(effects_.counters);
  }
  journal_.drop_taken();
}

}  // namespace soda::kernel
