// Online checkers: each knows one rule of Time Warp, keeps its own books, and throws Violation at
// the first thing that breaks it.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <vector>

#include "kernel/api/executed_log.hpp"
#include "kernel/api/run_observer.hpp"

namespace soda::kernel {

// GVT never goes back, is never above the floor of an LP or the time of a message on its way,
// nothing is sent to GVT or before, and only what is before GVT is committed.
class GvtChecker final : public RunObserver {
 public:
  void on_send(const Message& message) override;
  void on_deliver(const Message& message) override;
  void on_drop(const Message& message) override;
  void on_gvt(VirtualTime gvt, std::span<const VirtualTime> floors) override;
  void on_commit(LpId lp, VirtualTime now) override;

 private:
  VirtualTime gvt_ = kBeginning;
  std::multiset<VirtualTime> on_their_way_;
};

// Nothing is executed beyond the window, which is >= 1.
class WindowChecker final : public RunObserver {
 public:
  explicit WindowChecker(std::int64_t window) : window_(window) {}
  void on_execute(LpId lp, VirtualTime now, std::span<const MessageView> bag,
                  std::uint64_t digest) override;
  void on_gvt(VirtualTime gvt, std::span<const VirtualTime> floors) override;

 private:
  const std::int64_t window_;
  VirtualTime gvt_ = kBeginning;
};

// Follows the bags that are executed, through rollbacks, to their commit.
template <class Value>
class BagFollower : public RunObserver {
 public:
  void on_execute(LpId lp, VirtualTime now, std::span<const MessageView> bag,
                  std::uint64_t digest) final {
    bags_.execute(lp, now, value_of(lp, now, bag, digest));
  }
  void on_absorb(LpId lp, VirtualTime now, std::span<const MessageView> bag) final {
    bags_.put(lp, now, value_of(lp, now, bag, std::nullopt));
  }
  void on_jump(LpId lp, VirtualTime now, VirtualTime resume) final {
    bags_.restore(lp, now, resume);
  }
  void on_rewind(LpId lp, VirtualTime restart) final { bags_.rewind(lp, restart); }
  // A Violation if nothing that is executed at `now` waits for it.
  void on_commit(LpId lp, VirtualTime now) final;

 private:
  // What is kept of a bag, and of the state after it if that is known.
  virtual Value value_of(LpId lp, VirtualTime now, std::span<const MessageView> bag,
                         std::optional<std::uint64_t> digest) const = 0;
  virtual void on_committed(LpId lp, VirtualTime now, const Value& value) = 0;

  ExecutedLog<Value> bags_;
};

// (time, destination, source, kind, slot)
using MessageId = std::tuple<VirtualTime, LpId, LpId, std::uint32_t, std::uint32_t>;

// Every anti-message annihilates exactly one message; what is committed at a time consumed exactly
// the messages that live there; at the end, sent = consumed + annihilated + replaced, and nothing
// is on its way.
class ConservationChecker final : public BagFollower<std::vector<MessageId>> {
 public:
  void on_send(const Message& message) override;
  void on_deliver(const Message& message) override;
  void on_drop(const Message& message) override;
  void on_end() override;

 private:
  std::vector<MessageId> value_of(LpId lp, VirtualTime now, std::span<const MessageView> bag,
                                  std::optional<std::uint64_t> digest) const override;
  void on_committed(LpId lp, VirtualTime now, const std::vector<MessageId>& members) override;

  std::map<MessageId, std::uint64_t> live_;  // the version that its sender stands by
  std::uint64_t positive_ = 0, annihilated_ = 0, replaced_ = 0, consumed_ = 0;
  std::uint64_t sent_ = 0, delivered_ = 0;
};

// What an LP committed at a time: its bag and the digest of its state afterwards.
struct CommittedBag {
  VirtualTime time;
  std::uint64_t bag_digest = 0;
  std::optional<std::uint64_t> state_digest;  // unknown if the bag was absorbed

  friend bool operator==(const CommittedBag&, const CommittedBag&) = default;

  // Whether they can be the same: what is not known cannot differ.
  bool agrees_with(const CommittedBag& other) const {
    return time == other.time && bag_digest == other.bag_digest &&
           (!state_digest || !other.state_digest || *state_digest == *other.state_digest);
  }
};

// Of each LP, all that it committed, in order.
using CommitTrace = std::vector<std::vector<CommittedBag>>;

class TraceFollower : public BagFollower<CommittedBag> {
  CommittedBag value_of(LpId lp, VirtualTime now, std::span<const MessageView> bag,
                        std::optional<std::uint64_t> digest) const final;
};

// Records the trace of a run, the oracle's for example.
class TraceRecorder final : public TraceFollower {
 public:
  explicit TraceRecorder(std::size_t lps) : trace_(lps) {}

  const CommitTrace& trace() const { return trace_; }

 private:
  void on_committed(LpId lp, VirtualTime now, const CommittedBag& bag) override;

  CommitTrace trace_;
};

// Each commit is the oracle's, as it happens; at the end none is missing.
class TraceChecker final : public TraceFollower {
 public:
  // `oracle` must outlive this object.
  explicit TraceChecker(const CommitTrace& oracle) : oracle_(oracle), done_(oracle.size()) {}
  void on_end() override;

 private:
  void on_committed(LpId lp, VirtualTime now, const CommittedBag& bag) override;

  const CommitTrace& oracle_;
  std::vector<std::size_t> done_;  // commits of each LP
};

// Over the members of a bag in their order, with their payloads.
std::uint64_t digest_of(std::span<const MessageView> bag);

}  // namespace soda::kernel
