// The door between the workers of one rank and the other ranks: messages, records, GVT.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "kernel/api/message.hpp"
#include "kernel/api/transport.hpp"
#include "kernel/executors/distributed_executor.hpp"
#include "kernel/gvt/colour_count.hpp"

namespace soda::kernel {

// put() and reduces() from any worker of the rank; all else from the one that communicates.
class RankLink {
 public:
  // Both must outlive this object.
  RankLink(Transport& transport, const RecordHooks& records);

  std::uint32_t rank() const { return transport_.rank(); }

  // Takes messages for another rank, and leaves the vector empty.
  void put(std::uint32_t rank, std::vector<Message>& messages);
  bool has_outgoing() const { return has_outgoing_.load(std::memory_order_acquire); }

  // Sends what has been put, and records.
  void send_outgoing();
  // Appends the messages that have arrived; passes on records.
  void receive(std::vector<Message>& messages);

  // Whether a reduction is under way, so that a round of the rank's workers could not begin one.
  bool reduces() const { return reduces_.load(std::memory_order_acquire); }
  // Whether the next is the first of a computation of GVT.
  bool begins() const { return colours_.begins(); }
  // Begins one. Of the rank: the earliest floor, the first fault, and a stop request.
  void contribute(VirtualTime floor, const std::optional<CommittedFault>& fault,
                  std::uint32_t stop);
  enum class Progress { kNone, kAgain, kNewGvt };  // kAgain: messages were in transit
  // Looks whether the reduction has come to an end.
  Progress look();

  // The newest GVT that all ranks know, and the first fault before it: without its text.
  VirtualTime gvt() const { return gvt_; }
  const std::optional<CommittedFault>& fault() const { return fault_; }
  // The stop request that all ranks know of; the run ends at gvt(). 0: none.
  std::uint32_t stop() const { return stop_; }

  // When all ranks know of the end: waits until nothing is on its way here from any of them.
  void close();

 private:
  void send_records();
  void flush(std::uint32_t to, Bytes& packet);
  void take_in(const Transport::Packet& packet, std::vector<Message>& messages);

  Transport& transport_;
  const RecordHooks& records_;

  std::mutex mutex_;
  std::vector<std::vector<Message>> outgoing_;  // by rank
  std::atomic<bool> has_outgoing_{false};
  std::vector<Message> sending_;  // scratch

  ColourCount colours_;
  std::atomic<bool> reduces_{false};
  VirtualTime gvt_ = kBeginning;
  std::optional<CommittedFault> fault_;
  std::uint32_t stop_ = 0;
  std::uint32_t ended_ranks_ = 0;  // others that will send nothing more
};

}  // namespace soda::kernel
