#include "kernel/virtual_cluster/virtual_cluster.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "kernel/api/invariant.hpp"
#include "kernel/gvt/gvt.hpp"

namespace soda::kernel {

std::uint64_t network_bytes(const Message& message) {
  return kHeaderBytes + message.payload.size();
}

// Rounded up, without overflow for any message that fits into memory.
std::int64_t transfer_ns(std::uint64_t bytes, std::int64_t bytes_per_s) {
  if (bytes_per_s <= 0) return 0;
  const auto rate = static_cast<std::uint64_t>(bytes_per_s);
  const std::uint64_t whole_s = bytes / rate;
  const std::uint64_t rest = bytes % rate;
  // rest < rate, so rest * 1e9 fits for rates up to 18 GB/s; beyond that a microsecond is enough.
  constexpr std::uint64_t kNsPerS = 1'000'000'000;
  const std::uint64_t rest_ns = rate <= std::numeric_limits<std::uint64_t>::max() / kNsPerS
                                    ? (rest * kNsPerS + rate - 1) / rate
                                    : 1000 * (rest / (rate / 1'000'000) + 1);
  return static_cast<std::int64_t>(whole_s * kNsPerS + rest_ns);
}

VirtualCluster::VirtualCluster(std::span<const std::unique_ptr<LogicalProcess>> lps,
                               VirtualTime end, const VirtualOptions& options,
                               const ProgressFn& progress)
    : end_(end),
      options_(options),
      progress_(progress),
      partition_{lps.size(), std::min<std::size_t>(options.processors, lps.size())},
      recorder_(options.recording, 0),
      executing_(partition_.workers),
      links_(partition_.workers),
      external_(options.external, lps.size(), end),
      jitter_(append(options.seed, 0x6a69u)) {
  for (std::size_t i = 0; i < partition_.workers; ++i)
    processors_.emplace_back(i, partition_, lps, end, options, recorder_);
  report_.processors = static_cast<unsigned>(partition_.workers);
}

VirtualResult VirtualCluster::run() {
  for (std::uint32_t i = 0; i < processors_.size(); ++i) wake_later(i, 0);
  appoint(0, Action::kSampleGvt, 0);
  while (!finished_) {
    if (clock_user_is_next()) {
      let_clock_user_act();
      continue;
    }
    const Appointment next = next_appointment();
    set_now(next.at_ns);
    act(next);
  }
  return result();
}

void VirtualCluster::set_now(std::int64_t now_ns) {
  now_ns_ = now_ns;
  recorder_.set_clock(now_ns);
  if (options_.clock_user != nullptr) options_.clock_user->set_now(now_ns);
}

// After all else of the same time.
bool VirtualCluster::clock_user_is_next() const {
  if (options_.clock_user == nullptr) return false;
  const std::optional<std::int64_t> next_ns = options_.clock_user->next_ns();
  return next_ns && (appointments_.empty() || *next_ns < appointments_.front().at_ns);
}

void VirtualCluster::let_clock_user_act() {
  set_now(std::max(now_ns_, *options_.clock_user->next_ns()));
  compute_gvt_at_once();
  options_.clock_user->act();
  compute_gvt_at_once();
}

// One that is on its way is left to come.
void VirtualCluster::compute_gvt_at_once() {
  if (options_.gvt_delay_ns > 0 || finished_) return;
  sampled_gvt_ = external_.hold(true_gvt());
  if (sampled_gvt_ > gvt_) take_gvt();
}

VirtualCluster::Appointment VirtualCluster::next_appointment() {
  SODA_ASSERT(!appointments_.empty(), "nothing is left to happen at GVT ", gvt_);
  const auto later = [](const Appointment& a, const Appointment& b) {
    return std::pair(a.at_ns, a.number) > std::pair(b.at_ns, b.number);
  };
  std::pop_heap(appointments_.begin(), appointments_.end(), later);
  const Appointment next = appointments_.back();
  appointments_.pop_back();
  // GVT is looked at while everybody waits, too: that is not work.
  if (next.action != Action::kSampleGvt && next.action != Action::kAnnounceGvt) ++actions_;
  if (options_.max_actions > 0 && actions_ > options_.max_actions)
    throw Violation(
        describe("no end after ", options_.max_actions, " actions; GVT stands at ", gvt_));
  return next;
}

void VirtualCluster::appoint(std::int64_t at_ns, Action action, std::uint32_t index) {
  const auto later = [](const Appointment& a, const Appointment& b) {
    return std::pair(a.at_ns, a.number) > std::pair(b.at_ns, b.number);
  };
  appointments_.push_back({at_ns, appointments_made_++, action, index});
  std::push_heap(appointments_.begin(), appointments_.end(), later);
}

void VirtualCluster::act(const Appointment& appointment) {
  for (const auto word : {static_cast<std::uint64_t>(appointment.at_ns),
                          static_cast<std::uint64_t>(appointment.action),
                          static_cast<std::uint64_t>(appointment.index)})
    report_.execution_digest = append(report_.execution_digest, word);
  switch (appointment.action) {
    case Action::kArrive:
      return arrive(appointment.index);
    case Action::kWake:
      return wake(appointment.index);
    case Action::kComplete:
      return complete(appointment.index);
    case Action::kSent:
      return transmit_next(appointment.index);
    case Action::kSampleGvt:
      return sample_gvt();
    case Action::kAnnounceGvt:
      return announce_gvt();
  }
}

void VirtualCluster::arrive(std::uint32_t place) {
  const auto receiver =
      static_cast<std::uint32_t>(partition_.owner_of(in_flight_[place].destination));
  processors_[receiver].receive(std::move(in_flight_[place]));
  arrival_ns_[place] = -1;
  free_places_.push_back(place);
  if (!processors_[receiver].busy) wake_later(receiver, now_ns_);
}

// Once for everything that arrives at one point of the clock.
void VirtualCluster::wake_later(std::uint32_t processor, std::int64_t at_ns) {
  if (std::exchange(processors_[processor].wakes, true)) return;
  appoint(at_ns, Action::kWake, processor);
}

void VirtualCluster::wake(std::uint32_t processor) {
  processors_[processor].wakes = false;
  if (!processors_[processor].busy) start_next(processor);
}

void VirtualCluster::complete(std::uint32_t processor) {
  VirtualProcessor& done = processors_[processor];
  const Execution& last = executing_[processor];
  done.busy = false;
  done.clock.complete();
  last_completion_ns_ = now_ns_;
  if (options_.adversary && done.may_undo(last.own, last.time, sampled_gvt_) &&
      options_.adversary->undoes())
    done.undo(last.own, last.time);
  done.release(outgoing_);
  send_all(processor);
  start_next(processor);
}

// The processor is idle: takes in what has arrived, and executes if there is anything to execute.
void VirtualCluster::start_next(std::uint32_t index) {
  VirtualProcessor& processor = processors_[index];
  if (options_.adversary && now_ns_ >= processor.deaf_until_ns)
    processor.deaf_until_ns = now_ns_ + options_.adversary->hold_ns();
  if (now_ns_ >= processor.deaf_until_ns) {
    processor.take_in(outgoing_);
    send_all(index);
  }
  const std::optional<std::uint32_t> own = processor.choose(gvt_);
  if (!own) {
    if (now_ns_ < processor.deaf_until_ns) wake_later(index, processor.deaf_until_ns);
    if (options_.clock_user != nullptr) compute_gvt_at_once();  // the window may be the reason
    return;
  }
  const VirtualProcessor::Done done = processor.execute(*own, gvt_);
  executing_[index] = {*own, done.time};
  for (const auto word :
       {static_cast<std::uint64_t>(index_of(processor.id_of(*own))),
        static_cast<std::uint64_t>(done.time.t), static_cast<std::uint64_t>(done.time.round),
        static_cast<std::uint64_t>(done.cost_ns)})
    report_.execution_digest = append(report_.execution_digest, word);
  processor.busy = true;
  const std::int64_t stall_ns = options_.adversary ? options_.adversary->stall_ns() : 0;
  processor.clock.execute(now_ns_, done.cost_ns, stall_ns);
  appoint(processor.clock.now_ns(), Action::kComplete, index);
}

void VirtualCluster::send_all(std::uint32_t sender) {
  for (Message& message : outgoing_) {
    if (options_.bytes_per_s > 0)
      enqueue(sender, std::move(message));
    else
      put_in_flight(std::move(message), now_ns_);
  }
  outgoing_.clear();
}

void VirtualCluster::enqueue(std::uint32_t processor, Message message) {
  Link& link = links_[processor];
  const std::pair place(message.source,
                        OutputId{message.time, message.destination, message.kind, message.slot});
  const auto [known, is_new] = link.number_of.try_emplace(place, link.next_number);
  if (is_new) {
    link.waiting.emplace(link.next_number++, std::move(message));
    if (!link.busy) transmit_next(processor);
    return;
  }
  Message& older = link.waiting.at(known->second);
  if (options_.observer) options_.observer->on_drop(older);
  older = std::move(message);
}

void VirtualCluster::transmit_next(std::uint32_t processor) {
  Link& link = links_[processor];
  link.busy = !link.waiting.empty();
  if (!link.busy) return;
  Message message = std::move(link.waiting.begin()->second);
  link.waiting.erase(link.waiting.begin());
  link.number_of.erase(
      {message.source, OutputId{message.time, message.destination, message.kind, message.slot}});
  const std::int64_t sent_ns = now_ns_ + transfer_ns(network_bytes(message), options_.bytes_per_s);
  put_in_flight(std::move(message), sent_ns);
  appoint(sent_ns, Action::kSent, processor);
}

// `sent_ns`: when its last byte has left.
void VirtualCluster::put_in_flight(Message message, std::int64_t sent_ns) {
  ++report_.remote_messages;
  report_.remote_bytes += network_bytes(message);
  std::int64_t arrives_at_ns = sent_ns + options_.latency_ns;
  if (options_.jitter_ns > 0)
    arrives_at_ns += static_cast<std::int64_t>(
        jitter_.below(static_cast<std::uint64_t>(options_.jitter_ns) + 1));
  if (options_.adversary) arrives_at_ns += options_.adversary->message_delay_ns(message.anti);
  if (free_places_.empty()) {
    free_places_.push_back(static_cast<std::uint32_t>(in_flight_.size()));
    in_flight_.emplace_back();
    arrival_ns_.push_back(-1);
  }
  const std::uint32_t place = free_places_.back();
  free_places_.pop_back();
  in_flight_[place] = std::move(message);
  arrival_ns_[place] = arrives_at_ns;
  appoint(arrives_at_ns, Action::kArrive, place);
}

// Omniscient: the modelled computation takes time, but comes to the exact value of its start. What
// is being executed is not done yet; only what coasts may lie behind GVT.
VirtualTime VirtualCluster::true_gvt() const {
  VirtualTime gvt = kNever;
  for (std::size_t i = 0; i < processors_.size(); ++i) {
    gvt = std::min(gvt, processors_[i].floor());
    if (processors_[i].busy) gvt = std::min(gvt, std::max(executing_[i].time, sampled_gvt_));
  }
  for (std::size_t place = 0; place < in_flight_.size(); ++place)
    if (arrival_ns_[place] >= 0) gvt = std::min(gvt, in_flight_[place].time);
  for (const Link& link : links_)
    for (const auto& [number, message] : link.waiting) gvt = std::min(gvt, message.time);
  return gvt;
}

void VirtualCluster::sample_gvt() {
  sampled_gvt_ = external_.hold(true_gvt());
  appoint(now_ns_ + options_.gvt_delay_ns, Action::kAnnounceGvt, 0);
}

void VirtualCluster::announce_gvt() {
  ++run_.counters.gvt_rounds;
  SODA_ASSERT(sampled_gvt_ >= gvt_, "GVT goes back from ", gvt_, " to ", sampled_gvt_);
  tell_observer(sampled_gvt_);
  const bool stands = sampled_gvt_ == gvt_;
  if (!stands) take_gvt();
  for (std::size_t i = 0; stands && i < processors_.size(); ++i) charge_gvt(i, 0);
  if (options_.awaited && stands && appointments_.empty() && !finished_)
    for (std::uint32_t i = 0; i < processors_.size(); ++i) {
      processors_[i].stop_waiting();
      wake_later(i, now_ns_);
    }
  if (external_.exists() && !finished_) {
    take_external();
    // The outside may go by a clock of its own.
    if (stands && appointments_.empty() && options_.clock_user == nullptr) wait_for_external();
  }
  // What it costs the processors delays what they execute: one that began before would leave them
  // no time, and an interval of 0 would let the clock stand still.
  const std::int64_t least_ns = std::exchange(gvt_took_ns_, 0) + 1;
  appoint(now_ns_ + std::max(options_.gvt_interval_ns, least_ns), Action::kSampleGvt, 0);
}

void VirtualCluster::take_gvt() {
  commit(sampled_gvt_);
  for (std::uint32_t i = 0; i < processors_.size(); ++i)
    if (!processors_[i].busy) wake_later(i, now_ns_);
}

// No GVT is being computed now, so what is announced is the earliest time that is allowed.
void VirtualCluster::take_external() {
  std::vector<Message> taken;
  external_.take(gvt_, gvt_, taken);
  for (Message& message : taken) {
    if (options_.observer) options_.observer->on_send(message);
    put_in_flight(std::move(message), now_ns_);
  }
}

void VirtualCluster::charge_gvt(std::size_t processor, std::uint64_t committed) {
  const std::int64_t cost_ns =
      options_.gvt_cost_ns + options_.commit_cost_ns * static_cast<std::int64_t>(committed);
  gvt_took_ns_ = std::max(gvt_took_ns_, cost_ns);
  processors_[processor].clock.take_part_in_gvt(now_ns_, cost_ns, processors_[processor].busy);
}

void VirtualCluster::commit(VirtualTime gvt) {
  gvt_ = gvt;
  fault_ = fault_before(gvt);
  const bool at_end = fault_.has_value() || gvt >= end_;
  if (!at_end && options_.stop != nullptr) run_.stopped = options_.stop->load();
  finished_ = at_end || run_.stopped != 0;
  const VirtualTime limit = fault_ ? fault_->when : std::min(gvt, end_);
  std::uint64_t history = 0;
  Counters so_far = run_.counters;
  for (std::size_t i = 0; i < processors_.size(); ++i) {
    VirtualProcessor& processor = processors_[i];
    history += processor.history();
    charge_gvt(i, processor.commit(limit, gvt, finished_));
    if (progress_) so_far += processor.counters();
  }
  report_.most_history = std::max(report_.most_history, history);
  recorder_.gvt(gvt);
  if (progress_) progress_(std::min(gvt_, end_), so_far);
}

std::optional<CommittedFault> VirtualCluster::fault_before(VirtualTime gvt) const {
  std::optional<CommittedFault> first;
  for (const VirtualProcessor& processor : processors_) {
    const std::optional<CommittedFault> fault = processor.first_fault();
    if (fault && fault->when < gvt) keep_first(fault, first);
  }
  return first;
}

void VirtualCluster::tell_observer(VirtualTime gvt) const {
  if (!options_.observer) return;
  std::vector<VirtualTime> floors;
  for (const VirtualProcessor& processor : processors_)
    for (std::uint32_t own = 0; own < processor.lps(); ++own)
      floors.push_back(processor.floor_of(own));
  options_.observer->on_gvt(gvt, floors);
}

VirtualResult VirtualCluster::result() {
  report_.makespan_ns = last_completion_ns_;
  for (VirtualProcessor& processor : processors_) {
    run_.counters += processor.counters();
    processor.add_to(report_.account, processor.clock.end_run(report_.makespan_ns));
    report_.account.waiting_ns += processor.clock.waiting_ns();
    report_.account.gvt_ns += processor.clock.gvt_ns();
  }
  run_.kinds = recorder_.counts();
  recorder_.flush(true);
  run_.fault = fault_;
  run_.stopped_at = gvt_;
  if (options_.observer && !fault_ && run_.stopped == 0) options_.observer->on_end();
  return {std::move(run_), report_};
}

}  // namespace soda::kernel
