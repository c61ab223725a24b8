// The baseline on the virtual cluster: all processors pass through virtual time together.
#include <algorithm>
#include <deque>
#include <utility>

#include "kernel/api/hash_mix.hpp"
#include "kernel/api/invariant.hpp"
#include "kernel/gvt/gvt.hpp"
#include "kernel/virtual_cluster/virtual_cluster.hpp"

namespace soda::kernel {
namespace {

class LockstepCluster {
 public:
  LockstepCluster(std::span<const std::unique_ptr<LogicalProcess>> lps, VirtualTime end,
                  const VirtualOptions& options, const ProgressFn& progress)
      : end_(end),
        options_(options),
        progress_(progress),
        partition_{lps.size(), std::min<std::size_t>(options.processors, lps.size())},
        recorder_(options.recording, 0),
        clocks_ns_(partition_.workers, 0),
        external_(options.external, lps.size(), end),
        jitter_(append(options.seed, 0x6a69u)) {
    for (std::size_t i = 0; i < partition_.workers; ++i)
      processors_.emplace_back(i, partition_, lps, end, options, recorder_);
    report_.processors = static_cast<unsigned>(partition_.workers);
  }

  VirtualResult run() {
    VirtualTime now = after_external();
    while (now < end_) {
      const std::size_t sent = execute_all(now);
      if (sent > 0) meet();
      recorder_.set_clock(most());
      deliver_all();
      const VirtualTime next = earliest();
      if (sent == 0 && next.t != now.t) meet();
      if (!commit(std::min(external_.hold(next), end_))) break;
      now = after_external();
    }
    return result();
  }

 private:
  VirtualTime earliest() const {
    VirtualTime earliest = kNever;
    for (const VirtualProcessor& processor : processors_)
      earliest = std::min(earliest, processor.lowest_floor());
    return earliest;
  }

  // The time to be executed next, when nothing may come any more at that time. Everything that has
  // been executed is earlier than what may come.
  VirtualTime after_external() {
    while (external_.exists()) {
      const VirtualTime gvt = std::min(external_.hold(earliest()), end_);
      if (gvt >= end_) break;
      external_.take(gvt, gvt, outgoing_);
      if (options_.observer)
        for (const Message& message : outgoing_) options_.observer->on_send(message);
      // Before anything that is executed next, by the clock of its processor.
      recorder_.set_clock(*std::min_element(clocks_ns_.begin(), clocks_ns_.end()));
      deliver_all();
      const VirtualTime open_until = external_.hold(kNever);
      if (earliest() < open_until || open_until >= end_) break;
      wait_for_external();
    }
    return earliest();
  }

  // Returns how many messages that sent.
  std::size_t execute_all(VirtualTime now) {
    std::uint64_t sent = 0;
    for (std::size_t i = 0; i < processors_.size(); ++i) {
      VirtualProcessor& processor = processors_[i];
      const std::uint64_t before = processor.counters().messages;
      while (processor.lowest_floor() == now) {
        const std::uint32_t own = processor.lowest();
        recorder_.set_clock(clocks_ns_[i]);
        const VirtualProcessor::Done done = processor.execute(own, now);
        clocks_ns_[i] += done.cost_ns;
        for (const auto word :
             {static_cast<std::uint64_t>(index_of(processor.id_of(own))),
              static_cast<std::uint64_t>(now.t), static_cast<std::uint64_t>(now.round),
              static_cast<std::uint64_t>(clocks_ns_[i])})
          report_.execution_digest = append(report_.execution_digest, word);
        send(i);
      }
      sent += processor.counters().messages - before;
    }
    return sent;
  }

  void send(std::size_t sender) {
    VirtualProcessor& processor = processors_[sender];
    const std::size_t first = outgoing_.size();
    processor.release(outgoing_);
    for (std::size_t i = first; i < outgoing_.size(); ++i) {
      const std::uint64_t bytes = network_bytes(outgoing_[i]);
      ++report_.remote_messages;
      report_.remote_bytes += bytes;
      processor.link_free_at_ns = std::max(processor.link_free_at_ns, clocks_ns_[sender]) +
                                  transfer_ns(bytes, options_.bytes_per_s);
      std::int64_t arrives = processor.link_free_at_ns + options_.latency_ns;
      if (options_.jitter_ns > 0)
        arrives += static_cast<std::int64_t>(
            jitter_.below(static_cast<std::uint64_t>(options_.jitter_ns) + 1));
      last_arrival_ns_ = std::max(last_arrival_ns_, arrives);
    }
  }

  void deliver_all() {
    for (Message& message : outgoing_) {
      VirtualProcessor& receiver = processors_[partition_.owner_of(message.destination)];
      receiver.receive(std::move(message));
    }
    outgoing_.clear();
    for (VirtualProcessor& processor : processors_) processor.take_in(outgoing_);
    SODA_ASSERT(outgoing_.empty(), "a rollback in lockstep");
  }

  // Everybody waits for the slowest and for what is on its way.
  void meet() {
    std::int64_t latest = std::max(last_arrival_ns_, most());
    if (processors_.size() > 1) latest += options_.gvt_delay_ns;
    wait_until(latest);
    ++report_.barriers;
  }

  void wait_until(std::int64_t time_ns) {
    for (std::int64_t& clock_ns : clocks_ns_) {
      report_.account.waiting_ns += time_ns - clock_ns;
      clock_ns = time_ns;
    }
  }

  std::int64_t most() const { return *std::max_element(clocks_ns_.begin(), clocks_ns_.end()); }

  // False if the run ends with a fault, or is to stop.
  bool commit(VirtualTime gvt) {
    for (const VirtualProcessor& processor : processors_)
      keep_first(processor.first_fault(), run_.fault);
    const bool at_end = run_.fault || gvt >= end_;
    if (!at_end && options_.stop != nullptr) run_.stopped = options_.stop->load();
    run_.stopped_at = gvt;
    const bool finished = at_end || run_.stopped != 0;
    const VirtualTime limit = run_.fault ? run_.fault->when : gvt;
    Counters so_far;
    std::uint64_t history = 0;
    for (std::size_t i = 0; i < processors_.size(); ++i) {
      VirtualProcessor& processor = processors_[i];
      history += processor.history();
      const auto committed = static_cast<std::int64_t>(processor.commit(limit, gvt, finished));
      clocks_ns_[i] += options_.commit_cost_ns * committed;
      report_.account.gvt_ns += options_.commit_cost_ns * committed;
      if (progress_) so_far += processor.counters();
    }
    report_.most_history = std::max(report_.most_history, history);
    ++run_.counters.gvt_rounds;
    recorder_.set_clock(most());
    recorder_.gvt(gvt);
    if (progress_) progress_(limit, so_far);
    return !run_.fault && run_.stopped == 0;
  }

  VirtualResult result() {
    report_.makespan_ns = most();
    wait_until(most());
    run_.kinds = recorder_.counts();
    recorder_.flush(true);
    for (const VirtualProcessor& processor : processors_) {
      run_.counters += processor.counters();
      processor.add_to(report_.account, 0);
    }
    return {std::move(run_), report_};
  }

  const VirtualTime end_;
  const VirtualOptions& options_;
  const ProgressFn& progress_;
  const Partition partition_;
  EventRecorder recorder_;
  std::deque<VirtualProcessor> processors_;
  std::vector<std::int64_t> clocks_ns_;  // of each processor
  std::int64_t last_arrival_ns_ = 0;
  ExternalSourceDoor external_;
  std::vector<Message> outgoing_;
  SplitMix64 jitter_;
  RunResult run_;
  VirtualReport report_;
};

}  // namespace

VirtualResult run_virtual_lockstep(std::span<const std::unique_ptr<LogicalProcess>> lps,
                                   VirtualTime end, const VirtualOptions& options,
                                   const ProgressFn& progress) {
  return LockstepCluster(lps, end, options, progress).run();
}

}  // namespace soda::kernel
