// What a model implements to be simulated: the logical process (LP) and the outbox it writes to.
#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
#include <span>
#include <string>

#include "kernel/api/payload.hpp"
#include "kernel/api/virtual_time.hpp"

namespace soda::kernel {

// One message as its receiver sees it. Within a bag, messages are sorted by (source, kind, slot).
struct MessageView {
  LpId source;
  std::uint32_t kind;  // the model's message type
  std::uint32_t slot;  // 0, 1, ... among the messages of one (source, destination, time, kind)
  std::span<const std::byte> payload;
};

// A speculative fault: an absurd state that a handler met. With inputs missing it may be a mere
// artefact of optimism, so it is data; it becomes an error only when GVT passes its event.
struct Fault {
  std::uint64_t subject = 0;      // the model's identification of what failed (SODA: the body id)
  std::string what;               // one line for the user, with the offending value
  std::exception_ptr error = {};  // what left the handler, if that is the fault; the executor's
};

// Why an LP refused to absorb a change, in the model's terms: for traces, nothing depends on it.
struct Refusal {
  std::uint32_t code = 0;  // 0: it does not say
  std::uint64_t subject = 0, other = 0;
};

// Base of an exception that is not the model's but of who stands around it: it ends the run at
// once, even if it leaves a handler.
struct EndsRun {
  virtual ~EndsRun() = default;
};

// The only way a handler affects anything but its own state. Handlers may run speculatively, any
// number of times: no I/O, clock, random source or global state.
class Outbox {
 public:
  virtual ~Outbox() = default;
  // Sends to `destination` (itself allowed) at `when`, which must be strictly later than the time
  // being executed; anything else is a broken model and aborts with both times, in release too.
  // What is sent to the end of the run or later is dropped.
  virtual void send(LpId destination, VirtualTime when, std::uint32_t kind, Payload payload) = 0;
  // A hint, without effect on what is committed: all that this LP sends `destination` from now on
  // will differ from what executions that were undone have sent. So that is taken back at once,
  // not when the LP comes to it.
  virtual void cancel_eagerly(LpId /*destination*/) {}
  // Records a fault of the event being executed; the first one counts.
  virtual void fault(Fault fault) = 0;
};

// A logical process. All messages of one time arrive together, as one bag in canonical order;
// besides messages, an LP has a future event list: times at which it wants to run by itself.
//
// Contract: `execute` is a pure function of (state, now, bag). An optimistic executor calls
//   mark(now)      before execute(now, ...): the LP may save its state here (it need not at every
//                  time: it saves where its own restart points lie);
//                  The first call comes before the first execute and must save, and that state
//                  also serves a rewind to an earlier time than its own. After a rewind that
//                  returned `now`, the call may find that time saved already;
//   rewind(to)     restore the newest saved state with time <= to, drop later ones, return its
//                  time (or any earlier one after which nothing was executed): execution resumes
//                  there, with the inputs from that time on;
//   forget(horizon) no rewind(to) with to < horizon will follow: drop what that makes unreachable
//                  and return the time of the oldest state kept (the newest with time <= horizon);
//   commit(now)    exactly once for every executed time, in increasing order, when it can no
//                  longer be undone. Effects leave the program here and nowhere else. The state
//                  may already be far ahead: what commit needs, the LP keeps by time until then.
// An exception that leaves execute (std::bad_alloc, too) is a fault of that time: it is thrown to
// whoever runs the LPs if and when GVT passes it. Until then the LP is asked for nothing but
// forget(), commit() of what was before and rewind(), which must do whatever state the exception
// left. Of an execution that only repeats one that stood, it is thrown at once: that time it was
// not the model's. So is what any other call throws. Between two calls an LP may be moved from one
// thread to another, never used by two at once. The sequential executor calls execute and commit
// only: an LP whose mark was never called keeps no history. An LP with state_bytes() gets no mark,
// rewind or forget from any executor: derive it from SmallProcess (copy_history.hpp).
class LogicalProcess {
 public:
  virtual ~LogicalProcess() = default;
  // The next time on the future event list, > kBeginning and > the last executed time; kNever if
  // only messages wake the LP.
  virtual VirtualTime next_time() const = 0;
  virtual void execute(VirtualTime now, std::span<const MessageView> bag, Outbox& outbox) = 0;
  virtual void mark(VirtualTime now) = 0;
  virtual VirtualTime rewind(VirtualTime to) = 0;
  // What is called instead of rewind(to), for an LP that can do better: of what it has executed,
  // `undone` >= to is the earliest that is not before `to`. So the state that it saved at `undone`
  // is the one that `to` needs. It may restore that one, keep it as saved at `to`, and return `to`;
  // what came before then need not be executed again. CopyHistory does it.
  virtual VirtualTime rewind_before([[maybe_unused]] VirtualTime undone, VirtualTime to) {
    return rewind(to);
  }
  virtual VirtualTime forget(VirtualTime horizon) = 0;
  // Of an LP whose whole state is a few bytes that may be copied as such: where they are, as long
  // as it lives, a multiple of 8. The executor saves and restores them by itself, which is cheaper
  // by far than the calls for it. Asked once. Such an LP neither absorbs() nor jumps().
  virtual std::span<std::byte> state_bytes() { return {}; }
  // Called after a rollback of such an LP: the bytes are what they were before the first execution
  // at `to` or later, where execution resumes.
  virtual void rewound(VirtualTime /*to*/) {}
  // Called before a rollback for each changed time that the LP has executed or passed over,
  // earliest first: its messages are now `bag`, which is empty only if the time was on its future
  // event list. True if the executions that stand, with this one (which is there now if it was
  // not), send, leave behind and ask for just what they would with the new bag: then nothing is
  // undone, but what comes next may be executed in another way. False, and no change, if it cannot
  // tell. Asked only of an LP that absorbs(), which does not change.
  virtual bool absorb(VirtualTime /*now*/, std::span<const MessageView> /*bag*/) { return false; }
  virtual bool absorbs() const { return false; }
  // Of the last absorb() that was false.
  virtual Refusal refusal() const { return {}; }
  // Whether the LP, at one of its restart points, is in the state in which a rollback has undone
  // the execution that would come next. Asked only of an LP that jumps(), which does not change.
  virtual bool is_as_before() const { return false; }
  virtual bool jumps() const { return false; }
  // Called if it is: the bags are the same up to `limit`, so what was undone would come out as it
  // did. Puts it back in force up to a restart point <= limit, which is its next time then.
  virtual void jump(VirtualTime /*limit*/) {}
  // Dependency waits: whether an optimistic executor should wait before it executes `now` with this
  // bag, its next time, because the LP expects more messages of that time. A guess: it waits until
  // the bag has changed or GVT has reached `now`, so it costs time at most. A pure function of
  // (state, now, bag). Asked only of an LP that waits_for_dependencies(), which does not change.
  virtual bool holds(VirtualTime /*now*/, std::span<const MessageView> /*bag*/) const {
    return false;
  }
  virtual bool waits_for_dependencies() const { return false; }
  // After a rollback of an LP that waits_for_dependencies(): the LPs to which it will send other
  // messages than those that were undone, as far as it can tell. They are taken back at once, so
  // that nobody works with them.
  virtual std::vector<LpId> eager_cancellations() const { return {}; }
  virtual void commit(VirtualTime now) = 0;
  // Of all that later executions depend on. For checks only; 0 from an LP that does not tell.
  virtual std::uint64_t digest() const { return 0; }
};

}  // namespace soda::kernel
