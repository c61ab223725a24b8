#include "kernel/executors/recorded_executor.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "kernel/api/external_source.hpp"
#include "kernel/api/invariant.hpp"
#include "kernel/time_warp/time_warp_process.hpp"

namespace soda::kernel {
namespace {

class RecordedRun {
 public:
  RecordedRun(std::span<const std::unique_ptr<LogicalProcess>> lps, VirtualTime end,
              const RecordedOrder& order, std::span<const Message> external_messages,
              const Recording& recording)
      : end_(end),
        order_(order),
        recorder_(recording, 0),
        next_(order.workers.size(), 0),
        horizons_(lps.size(), kBeginning),
        is_settled_(lps.size(), true) {
    if (recording.kind_of != nullptr) effects_.recorder = &recorder_;
    processes_.reserve(lps.size());
    for (std::uint32_t i = 0; i < lps.size(); ++i)
      processes_.emplace_back(LpId{i}, lps.size(), *lps[i], end, pool_, journal_);
    for (const std::vector<RecordedAct>& acts : order.workers) {
      std::set<std::uint32_t> own;
      for (const RecordedAct& act : acts)
        if (act.what != Happening::kGvt) own.insert(index_of(act.lp));
      own_.emplace_back(own.begin(), own.end());
    }
    for (const Message& message : external_messages) add_external(message);
  }

  RunResult run() {
    bool goes_on = true;
    while (goes_on) {
      goes_on = false;
      for (std::size_t worker = 0; worker < next_.size(); ++worker)
        goes_on = run_worker(worker) || goes_on;
    }
    for (std::size_t worker = 0; worker < next_.size(); ++worker)
      if (next_[worker] < order_.workers[worker].size())
        refuse(worker, "waits for what is never sent");
    if (order_.whole) end();
    RunResult result;
    result.counters = effects_.counters;
    result.kinds = recorder_.counts();
    recorder_.flush(true);
    return result;
  }

 private:
  void end() {
    for (TimeWarpProcess& process : processes_) {
      if (process.next_time() < end_)
        throw NotAsRecorded(describe("LP ", index_of(process.id()), " would go on at ",
                                     process.next_time(), ", but the record ends"));
      process.commit(end_, effects_);
    }
  }

  // As far as what has been sent allows; whether it came any further.
  bool run_worker(std::size_t worker) {
    const std::size_t first = next_[worker];
    const std::vector<RecordedAct>& acts = order_.workers[worker];
    for (std::size_t& next = next_[worker]; next < acts.size(); ++next)
      if (!carry_out(worker, acts[next])) break;
    return next_[worker] > first;
  }

  bool carry_out(std::size_t worker, const RecordedAct& act) {
    if (act.what == Happening::kGvt) {
      commit(worker, std::min(act.time, end_));
      return true;
    }
    if (act.what == Happening::kArrived)
      return act.peer == kExternalSource ? arrive_external(worker, act) : arrive(worker, act);
    TimeWarpProcess& process = processes_[index_of(act.lp)];
    if (act.what == Happening::kSettled) {
      process.settle(effects_);
      is_settled_[index_of(act.lp)] = true;
    } else {
      if (process.next_time() != act.time || act.time >= end_ || !is_settled_[index_of(act.lp)])
        refuse(worker, describe("has executed ", act.time, ", but comes to ", process.next_time()));
      process.execute(effects_);
    }
    take_outgoing(worker);
    return true;
  }

  bool arrive(std::size_t worker, const RecordedAct& act) {
    const auto found = sent_.find({act.peer, act.version});
    if (found == sent_.end()) return false;
    if (found->second.destination != act.lp || found->second.time != act.time)
      refuse(worker, describe("is sent a message of LP ", index_of(act.peer), " for ", act.time,
                              ", which is now for LP ", index_of(found->second.destination), " at ",
                              found->second.time));
    deliver(worker, std::move(found->second));
    sent_.erase(found);
    take_outgoing(worker);
    return true;
  }

  bool arrive_external(std::size_t worker, const RecordedAct& act) {
    const auto found = external_messages_.find({act.time, act.lp, act.kind, act.slot});
    if (found == external_messages_.end())
      refuse(worker, describe("is sent something from outside for ", act.time,
                              " that is not there: kind ", act.kind, ", slot ", act.slot));
    found->second.version = act.version;
    deliver(worker, std::move(found->second));
    external_messages_.erase(found);
    take_outgoing(worker);
    return true;
  }

  void deliver(std::size_t worker, Message&& message) {
    const std::uint32_t lp = index_of(message.destination);
    if (message.time < horizons_[lp])
      refuse(worker, describe("is sent a message for ", message.time, ", before GVT"));
    if (processes_[lp].deliver(std::move(message), effects_)) is_settled_[lp] = false;
  }

  void add_external(const Message& message) {
    if (message.time >= end_) return;
    Message own = message;
    own.source = kExternalSource;
    if (order_.in_sequence) {
      own.version = next_version_++;
      processes_[index_of(own.destination)].deliver(std::move(own), effects_);
    } else {
      const OutputId name{own.time, own.destination, own.kind, own.slot};
      external_messages_.emplace(name, std::move(own));
    }
  }

  void take_outgoing(std::size_t worker) {
    std::vector<Message> outgoing;
    outgoing.swap(effects_.outgoing);
    for (Message& message : outgoing) {
      const std::pair name(message.source, std::uint64_t{message.version});
      if (order_.in_sequence)
        deliver(worker, std::move(message));
      else
        sent_.emplace(name, std::move(message));
    }
    effects_.revalidated.clear();
  }

  void commit(std::size_t worker, VirtualTime gvt) {
    if (gvt == kBeginning) return;  // a round before there was one
    for (const std::uint32_t lp : own_[worker]) {
      if (!is_settled_[lp] || processes_[lp].floor() < gvt)
        refuse(worker, describe("is before GVT ", gvt, ", at ", processes_[lp].floor()));
      if (gvt < horizons_[lp])
        refuse(worker, describe("is told of GVT ", gvt, " after ", horizons_[lp]));
      horizons_[lp] = gvt;
      processes_[lp].commit(gvt, effects_);
      processes_[lp].forget(gvt);
    }
  }

  [[noreturn]] void refuse(std::size_t worker, const std::string& what) const {
    const std::vector<RecordedAct>& acts = order_.workers[worker];
    const std::size_t at = std::min(next_[worker], acts.size() - 1);
    throw NotAsRecorded(
        describe("worker ", worker, ", act ", at, ": LP ", index_of(acts[at].lp), " ", what));
  }

  const VirtualTime end_;
  const RecordedOrder& order_;
  MessagePool pool_;
  Journal journal_;
  std::vector<TimeWarpProcess> processes_;
  EventRecorder recorder_;
  WorkerEffects effects_;
  std::vector<std::size_t> next_;                // of each worker, the act that comes next
  std::vector<std::vector<std::uint32_t>> own_;  // of each worker, its LPs
  std::vector<VirtualTime> horizons_;            // of each LP: what was committed
  std::vector<bool> is_settled_;                 // of each LP: it may execute
  std::map<std::pair<LpId, std::uint64_t>, Message> sent_;  // and not arrived
  std::map<OutputId, Message> external_messages_;           // the same
  std::uint64_t next_version_ = 1;                          // of what comes from there in sequence
};

}  // namespace

RunResult run_as_recorded(std::span<const std::unique_ptr<LogicalProcess>> lps, VirtualTime end,
                          const RecordedOrder& order, std::span<const Message> external_messages,
                          const Recording& recording) {
  RunResult result = RecordedRun(lps, end, order, external_messages, recording).run();
  raise_failure(result);
  return result;
}

}  // namespace soda::kernel
