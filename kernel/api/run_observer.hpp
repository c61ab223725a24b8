// What a checker sees of a run as it happens, and how a checker objects.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>
#include <vector>

#include "kernel/api/logical_process.hpp"
#include "kernel/api/message.hpp"
#include "kernel/api/virtual_time.hpp"

namespace soda::kernel {

// A run broke a rule; what() names the rule, the LP and the time.
class Violation : public std::runtime_error, public EndsRun {
 public:
  using std::runtime_error::runtime_error;
};

// Called from one thread, in the order of what happens. May throw Violation, which ends the run.
class RunObserver {
 public:
  virtual ~RunObserver() = default;
  // A message or anti-message leaves its LP; and comes to its receiver.
  virtual void on_send(const Message&) {}
  virtual void on_deliver(const Message&) {}
  // It will not come, for a newer version of it has been sent.
  virtual void on_drop(const Message&) {}
  // After the LP has executed `now`; `digest` is its LogicalProcess::digest().
  virtual void on_execute(LpId, VirtualTime /*now*/, std::span<const MessageView> /*bag*/,
                          std::uint64_t /*digest*/) {}
  // The bag of a time that is behind the LP has changed without effect.
  virtual void on_absorb(LpId, VirtualTime /*now*/, std::span<const MessageView> /*bag*/) {}
  // What the LP had executed at `restart` and later is undone.
  virtual void on_rewind(LpId, VirtualTime /*restart*/) {}
  // Of what was undone, what lies in [now, resume) is revalidated.
  virtual void on_jump(LpId, VirtualTime /*now*/, VirtualTime /*resume*/) {}
  virtual void on_commit(LpId, VirtualTime /*now*/) {}
  // A new GVT is announced, before anything is committed for it. `floors[i]` is that of LP i now.
  virtual void on_gvt(VirtualTime /*gvt*/, std::span<const VirtualTime> /*floors*/) {}
  // Everything has been executed and committed.
  virtual void on_end() {}
};

// An LP that tells an observer what is done with it. Works under every executor of one thread.
class ObservedProcess final : public LogicalProcess {
 public:
  // Both must outlive this object.
  ObservedProcess(LpId id, LogicalProcess& lp, RunObserver& observer)
      : id_(id), lp_(lp), observer_(observer) {}

  VirtualTime next_time() const override { return lp_.next_time(); }
  void execute(VirtualTime now, std::span<const MessageView> bag, Outbox& outbox) override {
    lp_.execute(now, bag, outbox);
    observer_.on_execute(id_, now, bag, lp_.digest());
  }
  void mark(VirtualTime now) override { lp_.mark(now); }
  VirtualTime rewind(VirtualTime to) override {
    const VirtualTime restart = lp_.rewind(to);
    observer_.on_rewind(id_, restart);
    return restart;
  }
  // Without it an observed run would restart earlier than the same run unobserved.
  VirtualTime rewind_before(VirtualTime undone, VirtualTime to) override {
    const VirtualTime restart = lp_.rewind_before(undone, to);
    observer_.on_rewind(id_, restart);
    return restart;
  }
  VirtualTime forget(VirtualTime horizon) override { return lp_.forget(horizon); }
  std::span<std::byte> state_bytes() override { return lp_.state_bytes(); }
  void rewound(VirtualTime to) override {
    lp_.rewound(to);
    observer_.on_rewind(id_, to);
  }
  bool absorb(VirtualTime now, std::span<const MessageView> bag) override {
    if (!lp_.absorb(now, bag)) return false;
    observer_.on_absorb(id_, now, bag);
    return true;
  }
  bool absorbs() const override { return lp_.absorbs(); }
  Refusal refusal() const override { return lp_.refusal(); }
  bool is_as_before() const override { return lp_.is_as_before(); }
  void jump(VirtualTime limit) override {
    const VirtualTime now = lp_.next_time();
    lp_.jump(limit);
    observer_.on_jump(id_, now, lp_.next_time());
  }
  bool jumps() const override { return lp_.jumps(); }
  bool holds(VirtualTime now, std::span<const MessageView> bag) const override {
    return lp_.holds(now, bag);
  }
  bool waits_for_dependencies() const override { return lp_.waits_for_dependencies(); }
  std::vector<LpId> eager_cancellations() const override { return lp_.eager_cancellations(); }
  void commit(VirtualTime now) override {
    lp_.commit(now);
    observer_.on_commit(id_, now);
  }
  std::uint64_t digest() const override { return lp_.digest(); }

 private:
  const LpId id_;
  LogicalProcess& lp_;
  RunObserver& observer_;
};

// One ObservedProcess for each LP.
std::vector<std::unique_ptr<LogicalProcess>> observed(
    std::span<const std::unique_ptr<LogicalProcess>> lps, RunObserver& observer);

// Passes everything on to several observers, in their order.
class ObserverList final : public RunObserver {
 public:
  explicit ObserverList(std::vector<RunObserver*> observers) : observers_(std::move(observers)) {}

  void on_send(const Message& message) override;
  void on_deliver(const Message& message) override;
  void on_drop(const Message& message) override;
  void on_execute(LpId lp, VirtualTime now, std::span<const MessageView> bag,
                  std::uint64_t digest) override;
  void on_absorb(LpId lp, VirtualTime now, std::span<const MessageView> bag) override;
  void on_jump(LpId lp, VirtualTime now, VirtualTime resume) override;
  void on_rewind(LpId lp, VirtualTime restart) override;
  void on_commit(LpId lp, VirtualTime now) override;
  void on_gvt(VirtualTime gvt, std::span<const VirtualTime> floors) override;
  void on_end() override;

 private:
  std::vector<RunObserver*> observers_;
};

}  // namespace soda::kernel
