// What is written down of a run's events: how many of each kind and, if asked for, the life of
// each.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>

#include "kernel/api/execution_times.hpp"
#include "kernel/api/logical_process.hpp"
#include "kernel/api/message.hpp"
#include "kernel/api/payload.hpp"
#include "kernel/api/virtual_time.hpp"

namespace soda::kernel {

// Executions by kind, as the model sorts their times, and messages by their own kind; what is
// kMostKinds - 1 or more counts there. The sums over the kinds are those of Counters.
struct EventCounts {
  static constexpr std::size_t kMostKinds = 16;
  struct OfExecutions {
    std::uint64_t executed = 0, rolled_back = 0, committed = 0;
  };
  struct OfMessages {
    std::uint64_t sent = 0, late = 0, anti = 0;
  };
  std::array<OfExecutions, kMostKinds> executions{};
  std::array<OfMessages, kMostKinds> messages{};
};
EventCounts& operator+=(EventCounts& sum, const EventCounts& more);

// What can happen to an event or a message of `lp`. Numbers are those of traces.
enum class Happening : std::uint8_t {
  kSent = 0,        // to `peer`, for `time`; by the execution of `other`, or a rollback: kBeginning
  kAdopted = 1,     // the same, but an equal message of an undone execution stands instead
  kArrived = 2,     // from `peer`, for `time`
  kLate = 3,        // and changes what has been executed; the note says of what it brings, or takes
  kExecuted = 4,    // `time`, from clock_ns on, for took_ns; `anew`: as it stood (coasts)
  kCost = 5,        // of what was executed last: took_ns, where it is known later
  kAbsorbed = 6,    // the bag of `time` has changed without effect; `anew`: and counts as executed
  kRewound = 7,     // goes back to `time` because of a change at `other`; the note is a Refusal
  kRolledBack = 8,  // the execution of `time` is undone
  kPutBack = 9,     // it is revalidated
  kJumped = 10,     // goes on at `time` without executing what lies between
  kCommitted = 11,  // `time`
  kGvt = 12,        // is `time`
  kSettled = 13,    // what had arrived late has been looked at
};
inline constexpr std::uint8_t kHappenings = 14;

constexpr bool is_of_message(Happening what) {
  return what == Happening::kSent || what == Happening::kAdopted || what == Happening::kArrived ||
         what == Happening::kLate;
}

// What belongs to a happening is set; the rest is as here.
struct TraceRecord {
  std::int64_t clock_ns = 0;  // of the executor's clock: steady from the run's begin, or modelled
  std::int64_t took_ns = 0;
  VirtualTime time;
  VirtualTime other = kBeginning;
  LpId lp{}, peer{};
  std::uint32_t kind = 0, slot = 0;  // of a message
  std::uint64_t version = 0;         // of a message: with its source, its name
  Happening what{};
  bool anti = false;
  bool anew = false;
  std::span<const std::byte> note{};
};

// Who gets a trace: chunks of one worker, in their order. Called by any worker thread.
class TraceSink {
 public:
  virtual ~TraceSink() = default;
  virtual void take(Bytes chunk) = 0;
};

// Of all executors.
struct Recording {
  // The kind of an execution by its time, or null: nothing is written down.
  std::uint8_t (*kind_of)(VirtualTime) = nullptr;
  TraceSink* trace = nullptr;  // null: events are counted only; else outlives the run
  // What a trace says of a late message: appended to `note`. Null: nothing.
  void (*describe)(std::uint32_t kind, std::span<const std::byte> payload, Bytes& note) = nullptr;
  // Whether the run tells where its workers' time has gone, by the machine's clock.
  bool accounts = false;
};

// The records of one chunk, for who reads a trace that may be damaged.
class TraceChunk {
 public:
  // `bytes` must outlive the object.
  explicit TraceChunk(std::span<const std::byte> bytes);

  // The worker whose chunk it is, over all ranks.
  std::uint32_t worker() const { return worker_; }
  // The next record; false at the end, or where no record could stand. `record.note` lies in the
  // chunk.
  bool next(TraceRecord& record);
  // Whether all up to here is as a recorder writes it.
  bool is_sound() const { return sound_; }

 private:
  std::uint64_t take_number();
  std::int64_t take_signed();
  VirtualTime take_time();

  std::span<const std::byte> left_;
  std::uint32_t worker_ = 0;
  std::int64_t clock_ns_ = 0;
  VirtualTime time_;
  bool sound_ = true;
};

// Of one worker. Each call is something that happens now.
class EventRecorder {
 public:
  EventRecorder(const Recording& recording, std::uint32_t worker);

  // Of an executor that models its clock; until then it is the machine's.
  void set_clock(std::int64_t now_ns) {
    models_clock_ = true;
    clock_ns_ = now_ns;
  }
  bool traces() const { return recording_.trace != nullptr; }
  // For executed(): when it began; 0 if nobody wants to know.
  std::int64_t now_ns() const;

  void sent(const Message& message, VirtualTime at);
  void adopted(const Message& message, VirtualTime at);
  void arrived(const Message& message);
  void late(const Message& message);
  void executed(LpId lp, VirtualTime time, std::int64_t began_ns, bool anew);
  void cost(LpId lp, std::int64_t took_ns);
  void settled(LpId lp);
  void absorbed(LpId lp, VirtualTime time, bool counts);
  void rewound(LpId lp, VirtualTime restart, VirtualTime changed, const Refusal& refusal);
  void rolled_back(LpId lp, VirtualTime time);
  void put_back(LpId lp, VirtualTime time);
  void jumped(LpId lp, VirtualTime resume);
  void committed(LpId lp, VirtualTime time);
  void gvt(VirtualTime gvt);
  // Hands over what it has, if that is worth it or must be.
  void flush(bool all);

  const EventCounts& counts() const { return counts_; }
  const ExecutionTimes& times() const { return times_; }

 private:
  EventCounts::OfExecutions& of(VirtualTime time);
  EventCounts::OfMessages& of(const Message& message);
  TraceRecord about(Happening what, LpId lp, VirtualTime time) const;
  void message_record(Happening what, const Message& message, VirtualTime at,
                      std::span<const std::byte> note);
  void write(const TraceRecord& record);
  void begin_chunk();
  void put_number(std::uint64_t number);
  void put_signed(std::int64_t number);
  void put_time(VirtualTime time);

  const Recording recording_;
  const std::uint32_t worker_;
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  EventCounts counts_;
  ExecutionTimes times_;
  bool models_clock_ = false;
  std::int64_t clock_ns_ = 0;
  Bytes chunk_;
  std::int64_t last_clock_ns_ = 0;  // of the chunk
  VirtualTime last_time_;
};

}  // namespace soda::kernel
