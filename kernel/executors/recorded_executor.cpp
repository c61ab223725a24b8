#include "kernel/executors/recorded_executor.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "kernel/api/invariant.hpp"
#include "kernel/time_warp/time_warp_process.hpp"

namespace soda::kernel {
namespace {

class RecordedRun {
 public:
  RecordedRun(std::span<const std::unique_ptr<LogicalProcess>> lps, VirtualTime end,
              const RecordedOrder& order, const Recording& recording)
      : end_(end),
        order_(order),
        recorder_(recording, 0),
        next_(order.size(), 0),
        horizons_(lps.size(), kBeginning),
        is_settled_(lps.size(), true) {
    if (recording.kind_of != nullptr) effects_.recorder = &recorder_;
    processes_.reserve(lps.size());
    for (std::uint32_t i = 0; i < lps.size(); ++i)
      processes_.emplace_back(LpId{i}, lps.size(), *lps[i], end, pool_, journal_);
    for (const std::vector<RecordedAct>& acts : order) {
      std::set<std::uint32_t> own;
      for (const RecordedAct& act : acts)
        if (act.what != Happening::kGvt) own.insert(index_of(act.lp));
      own_.emplace_back(own.begin(), own.end());
    }
  }

  RunResult run(bool whole) {
    bool goes_on = true;
    while (goes_on) {
      goes_on = false;
      for (std::size_t worker = 0; worker < order_.size(); ++worker)
        goes_on = run_worker(worker) || goes_on;
    }
    for (std::size_t worker = 0; worker < order_.size(); ++worker)
      if (next_[worker] < order_[worker].size()) refuse(worker, "waits for what is never sent");
    if (whole) end();
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
    for (std::size_t& next = next_[worker]; next < order_[worker].size(); ++next)
      if (!carry_out(worker, order_[worker][next])) break;
    return next_[worker] > first;
  }

  bool carry_out(std::size_t worker, const RecordedAct& act) {
    if (act.what == Happening::kGvt) {
      commit(worker, std::min(act.time, end_));
      return true;
    }
    TimeWarpProcess& process = processes_[index_of(act.lp)];
    if (act.what == Happening::kArrived) {
      const auto found = sent_.find({act.peer, act.incarnation});
      if (found == sent_.end()) return false;
      if (found->second.destination != act.lp || found->second.time != act.time)
        refuse(worker, describe("is sent a message of LP ", index_of(act.peer), " for ", act.time,
                                ", which is now for LP ", index_of(found->second.destination),
                                " at ", found->second.time));
      if (act.time < horizons_[index_of(act.lp)])
        refuse(worker, describe("is sent a message for ", act.time, ", before GVT"));
      if (process.deliver(std::move(found->second), effects_))
        is_settled_[index_of(act.lp)] = false;
      sent_.erase(found);
    } else if (act.what == Happening::kSettled) {
      process.settle(effects_);
      is_settled_[index_of(act.lp)] = true;
    } else {
      if (process.next_time() != act.time || act.time >= end_ || !is_settled_[index_of(act.lp)])
        refuse(worker, describe("has executed ", act.time, ", but comes to ", process.next_time()));
      process.execute(effects_);
    }
    take_outgoing();
    return true;
  }

  void take_outgoing() {
    for (Message& message : effects_.outgoing) {
      const std::pair name(message.source, std::uint64_t{message.incarnation});
      sent_.emplace(name, std::move(message));
    }
    effects_.outgoing.clear();
    effects_.stand_again.clear();
  }

  void commit(std::size_t worker, VirtualTime gvt) {
    if (gvt == kBeginning) return;  // a round before there was one
    for (const std::uint32_t lp : own_[worker]) {
      if (!is_settled_[lp] || processes_[lp].floor() < gvt)
        refuse(worker, describe("is before GVT ", gvt, ", at ", processes_[lp].floor()));
      horizons_[lp] = std::max(horizons_[lp], gvt);
      processes_[lp].commit(gvt, effects_);
      processes_[lp].forget(gvt);
    }
  }

  [[noreturn]] void refuse(std::size_t worker, const std::string& what) const {
    const std::size_t at = std::min(next_[worker], order_[worker].size() - 1);
    throw NotAsRecorded(describe("worker ", worker, ", act ", at, ": LP ",
                                 index_of(order_[worker][at].lp), " ", what));
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
};

}  // namespace

RunResult run_as_recorded(std::span<const std::unique_ptr<LogicalProcess>> lps, VirtualTime end,
                          const RecordedOrder& order, const Recording& recording, bool whole) {
  RunResult result = RecordedRun(lps, end, order, recording).run(whole);
  raise_failure(result);
  return result;
}

}  // namespace soda::kernel
