#include "analysis/trace/execution_trace.hpp"

#include <algorithm>
#include <map>
#include <numeric>
#include <unordered_map>
#include <utility>

namespace soda::analysis {
namespace {

using kernel::Happening;
using kernel::TraceRecord;
using kernel::VirtualTime;

void must_hold(bool holds, const std::string& what) {
  if (!holds) throw DecodeError(what);
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
      const auto found = senders_.find({message.from, message.version});
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
      world.sending.push_back(record.version);
      return;
    }
    Sender& sender = senders_[{kernel::index_of(record.lp), record.version}];
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
                           .version = record.version,
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
    for (const std::uint64_t version : world.sending)
      senders_[{kernel::index_of(record.lp), version}].execution = number;
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
