#include "kernel/virtual_cluster/virtual_processor.hpp"

#include <algorithm>
#include <utility>

#include "kernel/api/invariant.hpp"

namespace soda::kernel {

VirtualProcessor::VirtualProcessor(std::size_t index, const Partition& partition,
                                   std::span<const std::unique_ptr<LogicalProcess>> lps,
                                   VirtualTime end, const VirtualOptions& options,
                                   EventRecorder& recorder)
    : partition_(partition),
      index_(index),
      first_lp_(static_cast<std::uint32_t>(partition.first_of(index))),
      end_(end),
      options_(options),
      spent_(partition.first_of(index + 1) - first_lp_),
      undone_cost_(spent_.size()),
      undone_until_(spent_.size(), kBeginning),
      schedule_(spent_.size()),
      is_held_(spent_.size(), false),
      is_uncommitted_(spent_.size(), false),
      kept_(spent_.size(), 0) {
  if (options.recording.kind_of != nullptr) effects_.recorder = &recorder;
  awaits_ = options.awaited && partition.owner_of(options.awaited->destination) == index;
  processes_.reserve(spent_.size());
  for (std::uint32_t own = 0; own < spent_.size(); ++own) {
    const LpId id = id_of(own);
    processes_.emplace_back(id, lps.size(), *lps[index_of(id)], end, pool_, journal_);
    refresh(own);
  }
}

// All that has arrived is delivered before anything settles, as by a worker thread.
void VirtualProcessor::take_in(std::vector<Message>& outgoing) {
  while (!inbox_.empty()) {
    delivering_.swap(inbox_);
    for (Message& message : delivering_) {
      if (options_.observer) options_.observer->on_deliver(message);
      if (awaits_ && options_.awaited->is_id_of(message) &&
          message.version >= options_.awaited->version)
        awaits_ = false;
      const std::uint32_t own = index_of(message.destination) - first_lp_;
      if (processes_[own].deliver(std::move(message), effects_))
        touched_.push_back(own);
      else
        refresh(own);
    }
    delivering_.clear();
    for (const std::uint32_t own : touched_) settle(own);
    touched_.clear();
    route(outgoing);
  }
}

void VirtualProcessor::settle(std::uint32_t own) {
  const std::uint64_t before = effects_.counters.rolled_back;
  processes_[own].settle(effects_);
  note_revalidated(own);
  drop_undone(own, effects_.counters.rolled_back - before);
  refresh(own);
}

// What was undone and is revalidated has been paid for before.
void VirtualProcessor::note_revalidated(std::uint32_t own) {
  SlidingVector<Spent>& spent = spent_[own];
  for (const VirtualTime time : effects_.revalidated) {
    std::size_t at = spent.size();
    while (at > 0 && time < spent[at - 1].time) --at;
    const auto paid = undone_cost_[own].find(time);
    const bool is_known = paid != undone_cost_[own].end();
    const ExecutionCost cost = is_known ? paid->second : ExecutionCost{};
    spent.insert(at, {time, cost});
    rolled_back_ns_ -= cost.sum_ns();
    if (is_known) undone_cost_[own].erase(paid);
  }
  effects_.revalidated.clear();
}

// The latest that stand; what was committed already is not among them.
void VirtualProcessor::drop_undone(std::uint32_t own, std::uint64_t undone) {
  SlidingVector<Spent>& spent = spent_[own];
  const std::size_t standing = spent.size() - std::min<std::uint64_t>(undone, spent.size());
  for (std::size_t i = standing; i < spent.size(); ++i) {
    undone_cost_[own][spent[i].time] = spent[i].cost;
    rolled_back_ns_ += spent[i].cost.sum_ns();
  }
  spent.truncate(standing);
}

void VirtualProcessor::route(std::vector<Message>& outgoing) {
  tell_sent();
  told_sent_ = 0;
  for (Message& message : effects_.outgoing) {
    const bool own = partition_.owner_of(message.destination) == index_;
    (own ? inbox_ : outgoing).push_back(std::move(message));
  }
  effects_.outgoing.clear();
}

// At once, not when it leaves: from here on it holds GVT back.
void VirtualProcessor::tell_sent() {
  if (!options_.observer) return;
  for (; told_sent_ < effects_.outgoing.size(); ++told_sent_)
    options_.observer->on_send(effects_.outgoing[told_sent_]);
}

// As Worker::schedule(). Whatever happens to an LP, this follows.
void VirtualProcessor::refresh(std::uint32_t own) {
  note_uncommitted(own);
  if (processes_[own].has_fault()) may_be_faulty_.insert(own);
  if (options_.synchronisation == Synchronisation::kOptimistic && holds(own)) {
    schedule_.update(own, kNever);
    if (!is_held_[own]) held_.push_back(own);
    is_held_[own] = true;
  } else {
    schedule_.update(own, processes_[own].floor());
  }
}

void VirtualProcessor::stop_waiting() {
  if (std::exchange(awaits_, false)) refresh(index_of(options_.awaited->destination) - first_lp_);
}

bool VirtualProcessor::holds(std::uint32_t own) {
  const VirtualTime next = processes_[own].next_time();
  if (awaits_ && id_of(own) == options_.awaited->destination && next >= options_.awaited->time &&
      next < end_)
    return true;
  return processes_[own].holds(gvt_, effects_);
}

std::optional<std::uint32_t> VirtualProcessor::choose(VirtualTime gvt) {
  if (!within_window(schedule_.top_time(), gvt)) return std::nullopt;
  if (options_.adversary == nullptr) return schedule_.top();
  candidates_.clear();
  for (std::uint32_t own = 0; own < processes_.size(); ++own)
    if (within_window(schedule_.time_of(own), gvt)) candidates_.push_back(id_of(own));
  std::sort(candidates_.begin(), candidates_.end(), [&](LpId a, LpId b) {
    const auto key = [&](LpId lp) {
      return std::pair(schedule_.time_of(index_of(lp) - first_lp_), lp);
    };
    return key(a) < key(b);
  });
  return index_of(candidates_[options_.adversary->pick(candidates_)]) - first_lp_;
}

// Differences as unsigned numbers: the window may be as large as time itself.
bool VirtualProcessor::within_window(VirtualTime time, VirtualTime gvt) const {
  if (time >= end_) return false;
  if (options_.window == kWindowByWork)
    return time.t <= gvt.t || effects_.counters.uncommitted() < most_uncommitted(processes_.size());
  const auto lead = static_cast<std::uint64_t>(time.t) - static_cast<std::uint64_t>(gvt.t);
  return lead < static_cast<std::uint64_t>(options_.window);
}

VirtualProcessor::Done VirtualProcessor::execute(std::uint32_t own, VirtualTime gvt) {
  TimeWarpProcess& process = processes_[own];
  const VirtualTime now = process.next_time();
  if (now.t > gvt.t) {
    const auto lead = static_cast<std::uint64_t>(now.t) - static_cast<std::uint64_t>(gvt.t);
    effects_.counters.lead_sum += lead;
    effects_.counters.lead_max = std::max(effects_.counters.lead_max, lead);
  }
  const auto ask = [&] {
    return options_.cost ? options_.cost(id_of(own))
                         : ExecutionCost{.useful_ns = options_.bag_cost_ns};
  };
  process.execute(effects_);
  tell_sent();
  const ExecutionCost cost = ask();
  const std::int64_t cost_ns = cost.sum_ns();
  SODA_ASSERT(cost_ns >= 0, "LP ", index_of(id_of(own)), " at ", now, " costs ", cost_ns, " ns");
  if (effects_.recorder != nullptr) effects_.recorder->cost(id_of(own), cost_ns);
  if (options_.check_purity) {
    const Counters counted = effects_.counters;
    EventRecorder* const recorder = std::exchange(effects_.recorder, nullptr);
    process.repeat_last(effects_);
    effects_.counters = counted;
    effects_.recorder = recorder;
    ask();  // what the repetition cost is not part of the model
  }
  // What is executed again behind GVT was committed with what it cost then.
  if (now >= gvt_)
    spent_[own].push_back({now, cost});
  else
    rolled_back_ns_ += cost_ns;
  note_revalidated(own);
  refresh(own);
  return {now, cost_ns};
}

void VirtualProcessor::release(std::vector<Message>& outgoing) { route(outgoing); }

bool VirtualProcessor::may_undo(std::uint32_t own, VirtualTime time, VirtualTime gvt) const {
  return time >= gvt && time > undone_until_[own];
}

void VirtualProcessor::undo(std::uint32_t own, VirtualTime time) {
  const std::uint64_t before = effects_.counters.rolled_back;
  undone_until_[own] = time;
  processes_[own].undo(time, effects_);
  tell_sent();
  drop_undone(own, effects_.counters.rolled_back - before);
  refresh(own);
}

VirtualTime VirtualProcessor::floor() const {
  VirtualTime floor = schedule_.top_time();
  for (const std::uint32_t own : held_) floor = std::min(floor, processes_[own].floor());
  for (const Message& message : inbox_) floor = std::min(floor, message.time);
  for (const Message& message : effects_.outgoing) floor = std::min(floor, message.time);
  return floor;
}

std::optional<CommittedFault> VirtualProcessor::first_fault() const {
  std::optional<CommittedFault> first;
  for (const std::uint32_t own : may_be_faulty_) keep_first(processes_[own].first_fault(), first);
  return first;
}

std::uint64_t VirtualProcessor::commit(VirtualTime limit, VirtualTime gvt, bool finished) {
  const std::uint64_t before = executions_committed_;
  // In the end, too, who has been rolled back behind what was committed and has not run since.
  for (std::uint32_t own = 0; finished && own < processes_.size(); ++own) note_uncommitted(own);
  std::size_t left = 0;
  for (const std::uint32_t own : uncommitted_) {
    is_uncommitted_[own] = !commit_one(own, limit, gvt, finished);
    if (is_uncommitted_[own]) uncommitted_[left++] = own;
  }
  uncommitted_.resize(left);
  gvt_ = gvt;
  std::vector<std::uint32_t> held;
  held.swap(held_);
  for (const std::uint32_t own : held) {
    is_held_[own] = false;
    refresh(own);
  }
  return executions_committed_ - before;
}

void VirtualProcessor::add_to(TimeAccount& account, std::int64_t cut_ns) const {
  account.standing += committed_;
  account.rolled_back_ns += rolled_back_ns_ - cut_ns;
  for (const SlidingVector<Spent>& spent : spent_)
    for (const Spent& execution : spent) account.rolled_back_ns += execution.cost.sum_ns();
}

bool VirtualProcessor::commit_one(std::uint32_t own, VirtualTime limit, VirtualTime gvt,
                                  bool finished) {
  TimeWarpProcess& process = processes_[own];
  if (finished) process.coast_to(limit, effects_);
  process.commit(limit, effects_);
  if (!finished) process.forget(gvt);
  SlidingVector<Spent>& spent = spent_[own];
  std::size_t committed = 0;
  for (; committed < spent.size() && spent[committed].time < limit; ++committed)
    committed_ += spent[committed].cost;
  executions_committed_ += committed;
  spent.drop_front(committed);
  std::erase_if(undone_cost_[own], [gvt](const auto& item) { return item.first < gvt; });
  count_history(own);
  return process.is_committed() && !process.has_antis() && spent.empty() &&
         undone_cost_[own].empty();
}

void VirtualProcessor::count_history(std::uint32_t own) {
  const std::size_t executed = processes_[own].history_size().executed;
  history_ += executed - kept_[own];
  kept_[own] = executed;
}

std::size_t VirtualProcessor::history() {
  for (const std::uint32_t own : uncommitted_) count_history(own);
  return history_;
}

}  // namespace soda::kernel
