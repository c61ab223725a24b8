// What a worker has to do with other ranks, and with external sources.
#include <algorithm>
#include <utility>

#include "kernel/executors/worker.hpp"

namespace soda::kernel {
namespace {

// Soon, if messages were in transit the last time.
constexpr std::chrono::microseconds kTransit{20};

}  // namespace

void Worker::exchange_with_other_ranks() {
  RankLink& link = *group_.link;
  link.send_outgoing();
  // What was received now would be in no floor that this rank contributes with the outcome; and the
  // last GVT of all must not become known behind a report, or this rank would contribute once more.
  if (gvt_part_.awaits_outcome()) return;
  link.receive(received_);
  if (!received_.empty()) nap_ = kShortestNap;
  for (Message& message : received_)
    remote_[group_.partition.owner_of(message.destination)].push_back(std::move(message));
  received_.clear();
  hand_over_messages();

  const RankLink::Progress progress = link.look();
  if (progress == RankLink::Progress::kNewGvt) {
    nap_ = kShortestNap;
    round_due_ = contributed_at_ + kLongestBetweenRounds;
    const bool is_last = link.gvt() >= end_ || link.fault() || link.stop() != 0;
    if (is_last || (link.gvt() > gvt_ && group_.idle.load() > 0))
      request_round(&Counters::idle_rounds);
  } else if (progress == RankLink::Progress::kAgain) {
    round_due_ = contributed_at_ + kTransit;
  }
  if (std::chrono::steady_clock::now() >= round_due_) request_round(&Counters::timed_rounds);
}

// The others may have gone on already. That does not matter: what is sent here is as late as GVT,
// or as what this rank has contributed to the next one, and lies in the inboxes before the next
// round. Returns the earliest time of what was sent.
VirtualTime Worker::take_external(const GvtOutcome& outcome) {
  const bool reduces = communicates() && group_.link->reduces();
  const VirtualTime earliest = reduces ? contributed_ : outcome.gvt;
  std::vector<Message> taken;
  external_.take(outcome.gvt, earliest, taken);
  group_.held_externally.store(external_.hold(kNever) <= outcome.gvt);
  VirtualTime least = kNever;
  for (Message& message : taken) {
    least = std::min(least, message.time);
    remote_[group_.partition.owner_of(message.destination)].push_back(std::move(message));
  }
  hand_over_messages();
  if (communicates()) group_.link->send_outgoing();
  return least;
}

}  // namespace soda::kernel
