#include "kernel/executors/worker.hpp"

#include <algorithm>
#include <utility>

#include "kernel/api/invariant.hpp"

namespace soda::kernel {
namespace {

using std::chrono::microseconds;

// A worker that has used up its window needs a round to go on, but each round costs those who are
// busy time: it waits a little, and longer while GVT does not move.
constexpr microseconds kLeastPatience{50};
constexpr microseconds kMostPatience{2000};

}  // namespace

Worker::Worker(std::size_t index, WorkerGroup& group,
               std::span<const std::unique_ptr<LogicalProcess>> lps, VirtualTime end,
               const ThreadsOptions& options, const ProgressFn& progress)
    : index_(index),
      group_(group),
      end_(end),
      options_(options),
      progress_(progress),
      external_(group.first_worker + index == 0 ? options.external : nullptr, lps.size(), end),
      first_lp_(static_cast<std::uint32_t>(group.partition.first_of(group.first_worker + index))),
      holds_back_(options.scheduling_seed != 0 &&
                  options.synchronisation == Synchronisation::kOptimistic),
      is_alone_(
          group.partition.workers == 1 && group.link == nullptr && options.scheduling_seed == 0 &&
          options.synchronisation == Synchronisation::kOptimistic && options.external == nullptr),
      calendar_(pool_),
      schedule_(group.partition.first_of(group.first_worker + index + 1) - first_lp_),
      is_held_(schedule_.size(), false),
      uncommitted_(schedule_.size(), kNever),
      recorder_(options.recording, static_cast<std::uint32_t>(group.first_worker + index)),
      clock_(options.recording.accounts),
      remote_(group.partition.workers),
      gvt_part_(group.rounds),
      patience_(kLeastPatience),
      random_(append(options.scheduling_seed, index)) {
  processes_.reserve(schedule_.size());
  for (std::uint32_t own = 0; own < schedule_.size(); ++own) {
    const LpId id{first_lp_ + own};
    processes_.emplace_back(id, lps.size(), *lps[index_of(id)], end, pool_, journal_);
    refresh(own);
    is_plain_ = is_plain_ && processes_.back().is_plain();
  }
  if (options.recording.kind_of != nullptr) effects_.recorder = &recorder_;
  effects_.calendar = &calendar_;
  effects_.first_own = first_lp_;
  // A random scheduler decides about each message; but in lockstep nothing may be late.
  is_plain_ = is_plain_ && (!shuffles() || holds_back_);
  if (is_plain_ && !shuffles()) effects_.owns = static_cast<std::uint32_t>(schedule_.size());
}

void Worker::run() {
  while (!finished_) {
    clock_.enter(WorkerPhase::kMessages);
    take_in_messages();
    clock_.enter(WorkerPhase::kExecuting);
    execute_batch();
    clock_.enter(WorkerPhase::kMessages);
    hand_over_messages();
    if (communicates() && batch_took_ > kLongestBetweenRounds) exchange_with_other_ranks();
    if (gvt_part_.look())
      take_part_in_round();
    else if (!can_execute() || is_far_ahead())
      wait_for_work();
  }
  recorder_.flush(true);
  clock_.enter(WorkerPhase::kWaiting);
}

TimeAccount Worker::account(WorkerClock::Point end) {
  clock_.end_run(end);
  const ExecutionTimes& executions = recorder_.times();
  TimeAccount account;
  account.standing.useful_ns = executions.committed_ns();
  account.standing.sending_ns = clock_.in(WorkerPhase::kMessages);
  account.gvt_ns = clock_.in(WorkerPhase::kGvt);
  account.rolled_back_ns = executions.others_ns() + clock_.in(WorkerPhase::kUndoing);
  account.bookkeeping_ns =
      clock_.in(WorkerPhase::kExecuting)-executions.committed_ns() - executions.others_ns();
  account.waiting_ns = clock_.in(WorkerPhase::kWaiting);
  return account;
}

void Worker::take_in_messages() {
  if (!held_back_.empty()) release_held_back();
  if (communicates()) exchange_with_other_ranks();
  if (group_.inboxes[index_].filled()) group_.inboxes[index_].take(arrived_);
  deliver_arrived();
}

// All of a batch is delivered before any of its receivers settles: an anti-message and what
// replaces it, or two stragglers, cost one rollback.
void Worker::deliver_arrived() {
  if (arrived_.empty()) return;
  delivering_.swap(arrived_);
  for (Message& message : delivering_)
    deliver(index_of(message.destination) - first_lp_, std::move(message));
  delivering_.clear();
  settle_receivers();
}

inline void Worker::deliver(std::uint32_t own, Message&& message) {
  SODA_ASSERT(message.time >= gvt_, "message to LP ", index_of(message.destination), " at ",
              message.time, " behind GVT ", gvt_);
  if (holds_back_ && random_.below(4) == 0) {
    held_back_.push_back(std::move(message));
    return;
  }
  if (is_plain_ && message.first && (!shuffles() || random_.below(2) == 0))
    calendar_.push(pool_.put(std::move(message)));
  else
    deliver_now(own, std::move(message));
}

void Worker::deliver_now(std::uint32_t own, Message&& message) {
  if (processes_[own].deliver(std::move(message), effects_)) [[unlikely]]
    touched_.push_back(own);
  else if (own != executing_)  // which is scheduled when all it has sent is delivered
    schedule(own);
  note_uncommitted(own);  // it may have taken back what lay in the journal, or got an anti-message
}

void Worker::refresh(std::uint32_t own) {
  schedule(own);
  if (processes_[own].has_fault()) may_be_faulty_.push_back(own);
}

void Worker::route_outgoing() {
  for (Message& message : effects_.outgoing) {
    const std::uint32_t own = index_of(message.destination) - first_lp_;
    if (own < schedule_.size())
      deliver(own, std::move(message));
    else
      remote_[group_.partition.owner_of(message.destination)].push_back(std::move(message));
  }
  effects_.outgoing.clear();
}

// Settling may send to own LPs again.
void Worker::settle_receivers() {
  if (touched_.empty()) return;
  const WorkerPhase before = clock_.enter(WorkerPhase::kUndoing);
  while (!touched_.empty()) {
    for (const std::uint32_t own : touched_) {
      processes_[own].settle(effects_);
      effects_.revalidated.clear();
      refresh(own);
      note_uncommitted(own);
    }
    touched_.clear();
    route_outgoing();
  }
  clock_.enter(before);
}

void Worker::release_held_back() {
  delivering_.swap(held_back_);
  for (Message& message : delivering_)
    (random_.below(2) == 0 ? arrived_ : held_back_).push_back(std::move(message));
  delivering_.clear();
}

// An LP that holds is not scheduled, but counts for GVT, which releases it.
void Worker::schedule_waits(std::uint32_t own) {
  if (processes_[own].holds(gvt_, effects_) &&
      options_.synchronisation == Synchronisation::kOptimistic) {
    schedule_.update(own, kNever);
    effects_.counters.held += !is_held_[own];
    if (!is_held_[own]) held_.push_back(own);
    is_held_[own] = true;
  } else {
    schedule_.update(own, processes_[own].floor());
  }
}

void Worker::release_reached() {
  std::vector<std::uint32_t> held;
  held.swap(held_);
  for (const std::uint32_t own : held) {
    is_held_[own] = false;
    schedule(own);
  }
}

void Worker::hand_over_messages() {
  bool leaves = false;
  for (std::size_t receiver = 0; receiver < remote_.size(); ++receiver) {
    if (remote_[receiver].empty()) continue;
    const std::size_t here = receiver - group_.first_worker;  // very large if it is before them
    const bool stays = here < group_.inboxes.size();
    (stays ? effects_.counters.to_threads : effects_.counters.to_ranks) += remote_[receiver].size();
    if (stays) {
      for (const Message& message : remote_[receiver]) gvt_part_.note_sent(message.time);
      group_.inboxes[here].put(remote_[receiver]);
    } else {
      group_.link->put(group_.rank_of(receiver), remote_[receiver]);
      leaves = true;
    }
  }
  if (leaves && !communicates()) group_.inboxes[0].wake();
}

// Entered with nothing left in remote_.
void Worker::take_part_in_round() {
  clock_.enter(WorkerPhase::kGvt);
  finished_ = group_.rounds.run_stopped();
  if (finished_) return;
  if (!gvt_part_.awaits_outcome()) {
    executed_since_report_ = 0;
    last_report_ = std::chrono::steady_clock::now();
    if (!gvt_part_.report(make_report())) return;
    wake_others();
  }
  const GvtOutcome& outcome = gvt_part_.outcome();
  const bool at_end = outcome.fault || outcome.gvt >= end_;
  stopped_ = at_end ? 0 : outcome.stop;
  finished_ = at_end || stopped_ != 0;
  VirtualTime floor = outcome.least.floor;
  if (asks_external() && !finished_) floor = std::min(floor, take_external(outcome));
  if (communicates() && !finished_ && !group_.link->reduces()) {
    group_.link->send_outgoing();  // the others have put it there since this worker reported
    // In lockstep nothing may be executed that a message in transit comes before, or with: GVT is
    // not later than the first cut, for what is sent after it is later.
    const bool first =
        group_.link->begins() || options_.synchronisation != Synchronisation::kLockstep;
    contributed_ = first ? floor : std::min(floor, contributed_);
    contributed_at_ = std::chrono::steady_clock::now();
    group_.link->contribute(contributed_, outcome.least.fault, outcome.least.stop);
  }
  note_gvt(outcome.gvt);
  commit(outcome);
  const std::optional<Counters> sum = gvt_part_.finish(effects_.counters);
  if (!sum) return;
  if (progress_ && gvt_ > kBeginning) progress_(std::min(gvt_, end_), *sum);
  if (group_.rounds.end_round()) wake_others();
}

GvtReport Worker::make_report() {
  group_.inboxes[index_].take(arrived_);
  GvtReport report{external_.hold(earliest()), std::nullopt, std::nullopt};
  if (communicates()) {
    group_.link->send_outgoing();
    report.of_all_ranks = RankGvt{group_.link->gvt(), group_.link->fault()};
  }
  for (const std::uint32_t own : held_)
    report.floor = std::min(report.floor, processes_[own].floor());
  for (const Message& message : arrived_) report.floor = std::min(report.floor, message.time);
  for (const Message& message : held_back_) report.floor = std::min(report.floor, message.time);
  std::erase_if(may_be_faulty_, [&](std::uint32_t own) { return !processes_[own].has_fault(); });
  std::sort(may_be_faulty_.begin(), may_be_faulty_.end());
  may_be_faulty_.erase(std::unique(may_be_faulty_.begin(), may_be_faulty_.end()),
                       may_be_faulty_.end());
  for (const std::uint32_t own : may_be_faulty_)
    keep_first(processes_[own].first_fault(), report.fault);
  if (report.of_all_ranks) report.of_all_ranks->stop = group_.link->stop();
  if (options_.stop != nullptr) report.stop = options_.stop->load(std::memory_order_relaxed);
  return report;
}

void Worker::note_gvt(VirtualTime gvt) {
  patience_ = gvt > gvt_ ? kLeastPatience : std::min(2 * patience_, kMostPatience);
  gvt_ = gvt;
  open_until_ = end_of_window();
  if (!held_.empty()) release_reached();
}

// What is committed is collected when the LP executes next, and is in the cache anyway; but an LP
// that has executed all its times may get messages and their anti-messages for ever.
void Worker::commit(const GvtOutcome& outcome) {
  fault_ = outcome.fault;
  const VirtualTime limit = fault_ ? fault_->when : gvt_;
  if (finished_) return finish(std::min(limit, end_));
  while (uncommitted_.top_time() < gvt_) {
    const std::uint32_t own = uncommitted_.top();
    TimeWarpProcess& process = processes_[own];
    process.commit(gvt_, effects_);
    if (process.has_antis()) process.forget(gvt_);
    uncommitted_.update(own, process.uncommitted_from());
    SODA_ASSERT(uncommitted_.time_of(own) >= gvt_, "LP ", index_of(process.id()), " holds ",
                uncommitted_.time_of(own), " after its commit to ", gvt_);
  }
  collect_journal();
  recorder_.gvt(gvt_);
}

// All that is earlier than `limit` is executed, and committed.
void Worker::finish(VirtualTime limit) {
  take_back_journal();
  coast_to(limit);
  for (TimeWarpProcess& process : processes_) process.commit(limit, effects_);
}

void Worker::coast_to(VirtualTime limit) {
  for (TimeWarpProcess& process : processes_) {
    if (process.next_time() >= limit) continue;
    process.coast_to(limit, effects_);
  }
}

void Worker::wait_for_work() {
  if (!held_back_.empty()) return;
  clock_.enter(WorkerPhase::kWaiting);
  const Inbox& inbox = group_.inboxes[index_];
  if (gvt_part_.awaits_outcome())
    group_.rounds.spin_until([&] { return gvt_part_.is_asked() || inbox.filled(); });
  const bool all_idle = group_.idle.fetch_add(1) + 1 == group_.inboxes.size();
  if (all_idle && !group_.held_externally.load()) request_round(&Counters::idle_rounds);
  group_.inboxes[index_].sleep(communicates() ? nap_ : patience_, [&] {
    return gvt_part_.is_asked() || (communicates() && group_.link->has_outgoing());
  });
  nap_ = std::min(2 * nap_, kLongestNap);
  group_.idle.fetch_sub(1);
  if (!group_.inboxes[index_].filled()) request_round(&Counters::idle_rounds);
}

// Between ranks, a round can begin a reduction or make known the result of one.
void Worker::request_round(std::uint64_t Counters::*reason) {
  if (group_.link != nullptr && group_.link->reduces()) return;
  if (!group_.rounds.request()) return;
  ++(effects_.counters.*reason);
  wake_others();
}

void Worker::wake_others() {
  for (std::size_t other = 0; other < group_.inboxes.size(); ++other)
    if (other != index_) group_.inboxes[other].wake();
}

// The window may be as large as time itself.
VirtualTime Worker::end_of_window() const {
  if (options_.synchronisation != Synchronisation::kOptimistic)
    return std::min(VirtualTime{gvt_.t, gvt_.round + 1}, end_);
  std::int64_t window = options_.window;
  if (follows_work()) {
    const bool has_room =
        knows_gvt() || effects_.counters.uncommitted() < most_uncommitted(processes_.size());
    window = has_room ? kNever.t : 1;
  }
  const bool fits = gvt_.t <= kNever.t - window || gvt_.t < 0;
  return std::min(fits ? VirtualTime{gvt_.t + window, 0} : kNever, end_);
}

}  // namespace soda::kernel
