#include "analysis/trace/execution_trace.hpp"

#include <algorithm>
#include <cstdlib>
#include <map>
#include <numeric>
#include <unordered_map>
#include <utility>

#include "analysis/exit_codes.hpp"
#include "kernel/wire.hpp"
#include "models/event_kinds.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::analysis {
namespace {

using kernel::Happening;
using kernel::TraceRecord;
using kernel::VirtualTime;

// Those of many ranks can be more than there are worlds. What is kept for each is little.
constexpr std::uint32_t kMostWorkers = 1u << 20;

void must_hold(bool holds, const std::string& what) {
  if (!holds) throw DecodeError(what);
}

// What a world, a message or a body is called must be there.
void check(const TraceRecord& record, std::uint32_t worlds, std::size_t bodies) {
  // Times that sums of them can hold.
  must_hold(record.took_ns >= 0 && record.took_ns < std::int64_t{1} << 45 &&
                std::abs(record.clock_ns / 2) < std::int64_t{1} << 55,
            "tells of a time beyond any run");
  const auto is_world = [worlds](kernel::LpId lp) { return kernel::index_of(lp) < worlds; };
  if (record.what == Happening::kGvt) return;
  must_hold(is_world(record.lp), "tells of world " + std::to_string(kernel::index_of(record.lp)));
  if (is_of_message(record.what)) {
    must_hold(is_world(record.peer) || record.peer == kernel::kOutside,
              "tells of world " + std::to_string(kernel::index_of(record.peer)));
    must_hold(record.kind < models::message_kinds().size(),
              "tells of a message of kind " + std::to_string(record.kind));
  }
  if (record.what == Happening::kLate) {
    must_hold(record.note.size() % 4 == 0, "names half a body");
    for (const std::uint32_t body : noted_bodies(record))
      must_hold(body < bodies, "tells of body id " + std::to_string(body));
  }
  if (record.what == Happening::kRewound) {
    must_hold(record.note.size() == sizeof(std::uint32_t) + 2 * sizeof(std::uint64_t),
              "tells of a rollback without its reason");
    must_hold(noted_refusal(record).code < models::kRefusals, "tells of a reason that is none");
  }
}

// Follows the worlds through the records.
class Story {
 public:
  explicit Story(std::uint32_t worlds) : worlds_(worlds) { trace_.worlds = worlds; }

  void add(std::uint32_t worker, const TraceRecord& record) {
    trace_.workers = std::max(trace_.workers, worker + 1);
    World& world = worlds_[record.what == Happening::kGvt ? 0 : kernel::index_of(record.lp)];
    switch (record.what) {
      case Happening::kSent:
        return sent(world, record);
      case Happening::kLate:
        return late(world, record);
      case Happening::kExecuted:
        return executed(world, worker, record);
      case Happening::kCost:
        if (world.last) trace_.executions[*world.last].took_ns = record.took_ns;
        return;
      case Happening::kAbsorbed:
        return absorbed(world, worker, record);
      case Happening::kRewound:
        return rewound(world, record);
      case Happening::kRolledBack:
        return rolled_back(world, record);
      case Happening::kPutBack:
        return put_back(world, record);
      case Happening::kCommitted:
        if (const auto standing = world.standing.find(record.time);
            standing != world.standing.end())
          trace_.executions[standing->second].committed = true;
        return;
      case Happening::kAdopted:
      case Happening::kArrived:
      case Happening::kJumped:
      case Happening::kSettled:
      case Happening::kGvt:
        return;
    }
  }

  ExecutionTrace finish() {
    for (LateMessage& message : trace_.late) {
      const auto found = senders_.find({message.from, message.incarnation});
      if (found == senders_.end()) continue;
      message.sent_by = found->second.execution;
      message.sent_in = found->second.rollback;
    }
    sort_rollbacks();
    return std::move(trace_);
  }

 private:
  // What the sender of a message was doing.
  struct Sender {
    std::optional<ExecutionNumber> execution;
    std::optional<RollbackNumber> rollback;
  };
  struct World {
    std::map<VirtualTime, ExecutionNumber> standing, undone;
    std::vector<std::size_t> late;       // that have not been settled yet
    std::vector<std::uint64_t> sending;  // by the execution that is going on
    std::optional<ExecutionNumber> last;
    std::optional<RollbackNumber> last_rollback;
    bool rolls_back = false;  // nothing has been executed since
  };
  struct NameHash {
    std::size_t operator()(const std::pair<std::uint32_t, std::uint64_t>& name) const {
      return std::hash<std::uint64_t>()(name.second * 0x9e3779b97f4a7c15u + name.first);
    }
  };

  void sent(World& world, const TraceRecord& record) {
    if (record.other != kernel::kBeginning) {
      world.sending.push_back(record.incarnation);
      return;
    }
    Sender& sender = senders_[{kernel::index_of(record.lp), record.incarnation}];
    // An execution that does not send it any more stands for the rollback before.
    if (!world.rolls_back) sender.execution = world.last;
    sender.rollback = world.rolls_back || !world.last ? world.last_rollback
                                                      : trace_.executions[*world.last].again_for;
  }

  void late(World& world, const TraceRecord& record) {
    world.late.push_back(trace_.late.size());
    trace_.late.push_back({.from = kernel::index_of(record.peer),
                           .to = kernel::index_of(record.lp),
                           .time = record.time,
                           .kind = record.kind,
                           .slot = record.slot,
                           .incarnation = record.incarnation,
                           .anti = record.anti,
                           .arrived_ns = record.clock_ns,
                           .bodies = noted_bodies(record),
                           .absorbed = false,
                           .sent_by = {},
                           .sent_in = {}});
  }

  ExecutionNumber add_execution(World& world, std::uint32_t worker, const TraceRecord& record) {
    const ExecutionNumber number = trace_.executions.size();
    TracedExecution& execution = trace_.executions.emplace_back();
    execution.world = kernel::index_of(record.lp);
    execution.worker = worker;
    execution.time = record.time;
    execution.began_ns = record.clock_ns;
    execution.took_ns = record.took_ns;
    if (const auto before = world.undone.find(record.time); before != world.undone.end())
      execution.again_for = trace_.executions[before->second].undone_by;
    world.standing[record.time] = number;
    return number;
  }

  void executed(World& world, std::uint32_t worker, const TraceRecord& record) {
    const ExecutionNumber number = add_execution(world, worker, record);
    trace_.executions[number].repeats = record.anew;
    world.last = number;
    world.late.clear();  // what is left of it changed nothing
    world.rolls_back = false;
    for (const std::uint64_t incarnation : world.sending)
      senders_[{kernel::index_of(record.lp), incarnation}].execution = number;
    world.sending.clear();
  }

  void absorbed(World& world, std::uint32_t worker, const TraceRecord& record) {
    std::erase_if(world.late, [&](std::size_t late) {
      LateMessage& message = trace_.late[late];
      if (message.time != record.time) return false;
      message.absorbed = true;
      return true;
    });
    if (record.anew) trace_.executions[add_execution(world, worker, record)].absorbed = true;
  }

  void rewound(World& world, const TraceRecord& record) {
    world.last_rollback = trace_.rollbacks.size();
    world.rolls_back = true;
    TracedRollback& rollback = trace_.rollbacks.emplace_back();
    rollback.world = kernel::index_of(record.lp);
    rollback.restart = record.time;
    rollback.changed = record.other;
    rollback.at_ns = record.clock_ns;
    for (const std::size_t late : world.late)
      if (trace_.late[late].time == record.other) rollback.late.push_back(late);
    // Of what a model refused before, nothing is told of another cause.
    if (!rollback.late.empty()) rollback.refusal = noted_refusal(record);
    world.late.clear();
  }

  void rolled_back(World& world, const TraceRecord& record) {
    const auto found = world.standing.find(record.time);
    must_hold(found != world.standing.end() && world.last_rollback,
              "undoes what has not been executed");
    trace_.executions[found->second].undone_by = world.last_rollback;
    trace_.rollbacks[*world.last_rollback].undone.push_back(found->second);
    world.undone[record.time] = found->second;
    world.standing.erase(found);
  }

  void put_back(World& world, const TraceRecord& record) {
    const auto found = world.undone.find(record.time);
    must_hold(found != world.undone.end(), "puts back what has not been undone");
    TracedExecution& execution = trace_.executions[found->second];
    ++trace_.rollbacks[*execution.undone_by].put_back;
    execution.undone_by.reset();
    world.standing[record.time] = found->second;
    world.undone.erase(found);
  }

  // They were found worker by worker.
  void sort_rollbacks() {
    std::vector<RollbackNumber> order(trace_.rollbacks.size()), place(order.size());
    std::iota(order.begin(), order.end(), RollbackNumber{0});
    std::ranges::stable_sort(
        order, {}, [this](RollbackNumber rollback) { return trace_.rollbacks[rollback].at_ns; });
    std::vector<TracedRollback> sorted;
    for (std::size_t i = 0; i < order.size(); ++i) {
      place[order[i]] = i;
      sorted.push_back(std::move(trace_.rollbacks[order[i]]));
    }
    trace_.rollbacks = std::move(sorted);
    const auto renumber = [&place](std::optional<RollbackNumber>& number) {
      if (number) number = place[*number];
    };
    for (TracedExecution& execution : trace_.executions) {
      renumber(execution.undone_by);
      renumber(execution.again_for);
    }
    for (LateMessage& message : trace_.late) renumber(message.sent_in);
  }

  ExecutionTrace trace_;
  std::vector<World> worlds_;
  std::unordered_map<std::pair<std::uint32_t, std::uint64_t>, Sender, NameHash> senders_;
};

}  // namespace

std::vector<std::uint32_t> noted_bodies(const TraceRecord& record) {
  std::vector<std::uint32_t> bodies;
  for (std::span<const std::byte> left = record.note; left.size() >= sizeof(std::uint32_t);)
    bodies.push_back(kernel::take_number<std::uint32_t>(left));
  return bodies;
}

kernel::Refusal noted_refusal(const TraceRecord& record) {
  std::span<const std::byte> left = record.note;
  kernel::Refusal refusal;
  refusal.code = kernel::take_number<std::uint32_t>(left);
  refusal.subject = kernel::take_number<std::uint64_t>(left);
  refusal.other = kernel::take_number<std::uint64_t>(left);
  return refusal;
}

void read_records(LogReader& log, std::uint32_t worlds, const OnRecord& on_record) {
  if (log.options().level != LogLevel::kTrace)
    throw UsageError(log.file() + ": has no trace; soda run --log-level trace writes it");
  std::map<std::uint32_t, std::vector<std::size_t>> chunks;
  for (std::size_t i = 0; i < log.traces(); ++i) {
    const kernel::Bytes bytes = log.read_trace(i);
    chunks[kernel::TraceChunk(bytes).worker()].push_back(i);
  }
  for (const auto& [worker, places] : chunks)
    for (const std::size_t i : places) {
      const kernel::Bytes bytes = log.read_trace(i);
      kernel::TraceChunk chunk(bytes);
      try {
        must_hold(worker < kMostWorkers, "tells of worker " + std::to_string(worker));
        for (TraceRecord record; chunk.next(record);) {
          check(record, worlds, log.labels().size());
          on_record(worker, record);
        }
        must_hold(chunk.is_sound(), "ends inside a record");
      } catch (const DecodeError& fault) {
        throw scenarios::FileError(log.file() + ": trace block " + std::to_string(i) + ": " +
                                   fault.what());
      }
    }
}

ExecutionTrace read_trace(LogReader& log, std::uint32_t worlds) {
  Story story(worlds);
  read_records(log, worlds, [&story](std::uint32_t worker, const TraceRecord& record) {
    story.add(worker, record);
  });
  return story.finish();
}

std::optional<RollbackNumber> ExecutionTrace::led_to(RollbackNumber rollback) const {
  for (const std::size_t index : rollbacks[rollback].late) {
    const LateMessage& message = late[index];
    if (message.sent_in) return message.sent_in;
    if (message.sent_by && executions[*message.sent_by].again_for)
      return executions[*message.sent_by].again_for;
  }
  return std::nullopt;
}

std::int64_t ExecutionTrace::wasted_ns(RollbackNumber rollback) const {
  std::int64_t wasted = 0;
  for (const ExecutionNumber number : rollbacks[rollback].undone)
    if (executions[number].undone_by == rollback) wasted += executions[number].took_ns;
  return wasted;
}

}  // namespace soda::analysis
