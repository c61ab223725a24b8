#include "kernel/api/checkers.hpp"

#include "kernel/api/external_source.hpp"
#include "kernel/api/hash_mix.hpp"
#include "kernel/api/invariant.hpp"

namespace soda::kernel {
namespace {

template <class... Values>
void require(bool holds, const Values&... values) {
  if (!holds) throw Violation(describe(values...));
}

}  // namespace

void GvtChecker::on_send(const Message& message) {
  const bool in_time =
      message.source == kExternalSource ? message.time >= gvt_ : message.time > gvt_;
  require(in_time, "LP ", index_of(message.source), " sends ",
          message.anti ? "an anti-message" : "a message", " to LP ", index_of(message.destination),
          " at ", message.time, ", GVT is ", gvt_);
  on_their_way_.insert(message.time);
}

void GvtChecker::on_deliver(const Message& message) {
  const auto sent = on_their_way_.find(message.time);
  require(sent != on_their_way_.end(), "LP ", index_of(message.destination),
          " receives a message at ", message.time, " that nobody sent");
  on_their_way_.erase(sent);
}

void GvtChecker::on_drop(const Message& message) { on_deliver(message); }

void GvtChecker::on_gvt(VirtualTime gvt, std::span<const VirtualTime> floors) {
  require(gvt >= gvt_, "GVT goes back from ", gvt_, " to ", gvt);
  gvt_ = gvt;
  for (std::size_t lp = 0; lp < floors.size(); ++lp)
    require(gvt <= floors[lp], "GVT ", gvt, " is above the floor ", floors[lp], " of LP ", lp);
  require(on_their_way_.empty() || gvt <= *on_their_way_.begin(), "GVT ", gvt,
          " is above a message on its way to ",
          on_their_way_.empty() ? gvt : *on_their_way_.begin());
}

void GvtChecker::on_commit(LpId lp, VirtualTime now) {
  require(now < gvt_, "LP ", index_of(lp), " commits ", now, ", GVT is ", gvt_);
}

void WindowChecker::on_execute(LpId lp, VirtualTime now, std::span<const MessageView>,
                               std::uint64_t) {
  if (now <= gvt_) return;
  const auto lead = static_cast<std::uint64_t>(now.t) - static_cast<std::uint64_t>(gvt_.t);
  require(lead < static_cast<std::uint64_t>(window_), "LP ", index_of(lp), " executes ", now,
          ", GVT is ", gvt_, ", the window ", window_);
}

void WindowChecker::on_gvt(VirtualTime gvt, std::span<const VirtualTime>) { gvt_ = gvt; }

void ConservationChecker::on_send(const Message& message) {
  ++sent_;
  const MessageId place{message.time, message.destination, message.source, message.kind,
                        message.slot};
  const auto live = live_.find(place);
  if (message.anti) {
    require(live != live_.end(), "the anti-message of LP ", index_of(message.source), " to LP ",
            index_of(message.destination), " at ", message.time, " (kind ", message.kind, ", slot ",
            message.slot, ") annihilates nothing");
    require(live->second < message.version, "the anti-message of LP ", index_of(message.source),
            " to LP ", index_of(message.destination), " at ", message.time,
            " is older than what it annihilates");
    live_.erase(live);
    ++annihilated_;
    return;
  }
  ++positive_;
  if (live != live_.end()) ++replaced_;
  live_[place] = message.version;
}

void ConservationChecker::on_deliver(const Message&) { ++delivered_; }

void ConservationChecker::on_drop(const Message&) { ++delivered_; }

template <class Value>
void BagFollower<Value>::on_commit(LpId lp, VirtualTime now) {
  const std::optional<Value> value = bags_.commit(lp, now);
  require(value.has_value(), "LP ", index_of(lp), " commits ", now,
          ", which is not executed or was committed before");
  on_committed(lp, now, *value);
}

template class BagFollower<std::vector<MessageId>>;
template class BagFollower<CommittedBag>;

std::vector<MessageId> ConservationChecker::value_of(LpId lp, VirtualTime now,
                                                     std::span<const MessageView> bag,
                                                     std::optional<std::uint64_t>) const {
  std::vector<MessageId> members;
  for (const MessageView& message : bag)
    members.emplace_back(now, lp, message.source, message.kind, message.slot);
  return members;
}

void ConservationChecker::on_committed(LpId lp, VirtualTime now,
                                       const std::vector<MessageId>& members) {
  for (const MessageId& member : members) {
    require(live_.erase(member) == 1, "LP ", index_of(lp), " commits ", now,
            " with a message of LP ", index_of(std::get<2>(member)), " (kind ", std::get<3>(member),
            ", slot ", std::get<4>(member), ") that its sender took back");
    ++consumed_;
  }
  const auto left = live_.lower_bound({now, lp, LpId{0}, 0, 0});
  require(left == live_.end() || std::get<0>(left->first) != now || std::get<1>(left->first) != lp,
          "LP ", index_of(lp), " commits ", now, " without a message that was sent to it");
}

void ConservationChecker::on_end() {
  require(sent_ == delivered_, sent_ - delivered_, " messages are still on their way at the end");
  require(live_.empty(), live_.size(), " messages were never consumed, the first at ",
          live_.empty() ? kNever : std::get<0>(live_.begin()->first));
  require(positive_ == consumed_ + annihilated_ + replaced_, positive_, " sent, ", consumed_,
          " consumed, ", annihilated_, " annihilated, ", replaced_, " replaced");
}

CommittedBag TraceFollower::value_of(LpId, VirtualTime now, std::span<const MessageView> bag,
                                     std::optional<std::uint64_t> digest) const {
  return {now, digest_of(bag), digest};
}

void TraceRecorder::on_committed(LpId lp, VirtualTime, const CommittedBag& bag) {
  trace_[index_of(lp)].push_back(bag);
}

void TraceChecker::on_committed(LpId lp, VirtualTime now, const CommittedBag& bag) {
  const std::vector<CommittedBag>& expected = oracle_[index_of(lp)];
  const std::size_t place = done_[index_of(lp)]++;
  require(place < expected.size(), "LP ", index_of(lp), " commits ", now,
          ", the sequential run nothing more");
  require(bag.agrees_with(expected[place]), "LP ", index_of(lp), " commits ", now, " with bag ",
          bag.bag_digest, " and state ", bag.state_digest.value_or(0), ", the sequential run ",
          expected[place].time, " with bag ", expected[place].bag_digest, " and state ",
          expected[place].state_digest.value_or(0));
}

void TraceChecker::on_end() {
  for (std::size_t lp = 0; lp < oracle_.size(); ++lp)
    require(done_[lp] == oracle_[lp].size(), "LP ", lp, " has committed ", done_[lp],
            " times, in the sequential run ", oracle_[lp].size());
}

std::uint64_t digest_of(std::span<const MessageView> bag) {
  std::uint64_t digest = 0;
  for (const MessageView& message : bag) {
    for (const std::uint64_t word :
         {std::uint64_t{index_of(message.source)}, std::uint64_t{message.kind},
          std::uint64_t{message.slot}, std::uint64_t{message.payload.size()}})
      digest = append(digest, word);
    for (const std::byte byte : message.payload)
      digest = append(digest, static_cast<std::uint64_t>(byte));
  }
  return digest;
}

}  // namespace soda::kernel
