// The optimistic virtual cluster as a discrete-event simulation on the virtual wall clock.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "kernel/api/hash_mix.hpp"
#include "kernel/api/partition.hpp"
#include "kernel/virtual_cluster/virtual_executor.hpp"
#include "kernel/virtual_cluster/virtual_processor.hpp"

namespace soda::kernel {

class VirtualCluster {
 public:
  VirtualCluster(std::span<const std::unique_ptr<LogicalProcess>> lps, VirtualTime end,
                 const VirtualOptions& options, const ProgressFn& progress);

  VirtualResult run();

 private:
  enum class Action : std::uint32_t {
    kArrive,    // a message at a processor
    kWake,      // a processor looks at what has arrived
    kComplete,  // of an execution
    kSent,      // a processor's network link has finished a message
    kSampleGvt,
    kAnnounceGvt,
  };
  // What happens at a point of the wall clock; those of one point in the order of their making.
  struct Appointment {
    std::int64_t at_ns = 0;
    std::uint64_t number = 0;
    Action action{};
    std::uint32_t index = 0;  // processor; or, of kArrive, place in in_flight_
  };
  // What waits for a processor's link. A message that has not begun to leave is replaced by a newer
  // version of it, so that however slow the link, versions do not pile up.
  struct Link {
    std::uint64_t next_number = 0;
    std::map<std::uint64_t, Message> waiting;  // by number, in the order of leaving
    std::map<std::pair<LpId, OutputId>, std::uint64_t> number_of;  // by source and message id
    bool busy = false;
  };
  struct Execution {
    std::uint32_t own = 0;
    VirtualTime time;
  };

  void set_now(std::int64_t now_ns);
  bool clock_user_is_next() const;
  void let_clock_user_act();
  void compute_gvt_at_once();
  Appointment next_appointment();
  void act(const Appointment& appointment);
  void arrive(std::uint32_t place);
  void wake(std::uint32_t processor);
  void complete(std::uint32_t processor);
  void start_next(std::uint32_t processor);
  void sample_gvt();
  void announce_gvt();
  void take_gvt();
  void take_external();

  void appoint(std::int64_t at_ns, Action action, std::uint32_t index);
  void wake_later(std::uint32_t processor, std::int64_t at_ns);
  void send_all(std::uint32_t processor);
  void enqueue(std::uint32_t processor, Message message);
  void transmit_next(std::uint32_t processor);
  void put_in_flight(Message message, std::int64_t sent_ns);
  VirtualTime true_gvt() const;
  std::optional<CommittedFault> fault_before(VirtualTime gvt) const;
  void charge_gvt(std::size_t processor, std::uint64_t committed);
  void commit(VirtualTime gvt);
  void tell_observer(VirtualTime gvt) const;
  VirtualResult result();

  const VirtualTime end_;
  const VirtualOptions& options_;
  const ProgressFn& progress_;
  const Partition partition_;
  EventRecorder recorder_;
  std::deque<VirtualProcessor> processors_;
  std::vector<Execution> executing_;  // of each processor
  std::vector<Link> links_;           // of each processor, if bandwidth is limited

  std::vector<Appointment> appointments_;  // a heap, the earliest in front
  std::uint64_t appointments_made_ = 0;
  std::vector<Message> in_flight_;
  std::vector<std::int64_t> arrival_ns_;  // of in_flight_; < 0: free place
  std::vector<std::uint32_t> free_places_;
  std::vector<Message> outgoing_;  // scratch
  ExternalSourceDoor external_;

  std::int64_t now_ns_ = 0;
  std::int64_t last_completion_ns_ = 0;
  std::uint64_t actions_ = 0;
  VirtualTime gvt_ = kBeginning;          // announced
  VirtualTime sampled_gvt_ = kBeginning;  // announced or on its way
  std::int64_t gvt_took_ns_ = 0;          // a processor at most, since the last was announced
  std::optional<CommittedFault> fault_;
  bool finished_ = false;
  SplitMix64 jitter_;
  RunResult run_;
  VirtualReport report_;
};

// The baseline; see run_virtual.
VirtualResult run_virtual_lockstep(std::span<const std::unique_ptr<LogicalProcess>> lps,
                                   VirtualTime end, const VirtualOptions& options,
                                   const ProgressFn& progress);

// What both of them share.
std::uint64_t network_bytes(const Message& message);
std::int64_t transfer_ns(std::uint64_t bytes, std::int64_t bytes_per_s);

}  // namespace soda::kernel
