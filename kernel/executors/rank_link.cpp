#include "kernel/executors/rank_link.hpp"

#include <chrono>
#include <thread>
#include <utility>

#include "kernel/api/wire.hpp"

namespace soda::kernel {
namespace {

// First byte of a packet. Messages are followed by the colour and then by each other.
enum class PacketKind : std::uint8_t { kMessages, kRecord, kEnd };

// A packet that is about to become longer leaves: MPI's way with larger ones waits for the other
// side, and on a network one lost segment holds up all of it.
constexpr std::size_t kFullPacket = 60'000;

Bytes begin_packet(PacketKind kind) { return {static_cast<std::byte>(kind)}; }

}  // namespace

RankLink::RankLink(Transport& transport, const RecordHooks& records)
    : transport_(transport), records_(records), outgoing_(transport.size()) {}

void RankLink::put(std::uint32_t rank, std::vector<Message>& messages) {
  const std::lock_guard lock(mutex_);
  move_all(messages, outgoing_[rank]);
  has_outgoing_.store(true, std::memory_order_release);
}

void RankLink::send_outgoing() {
  if (records_.take) send_records();
  if (!has_outgoing()) return;
  for (std::uint32_t to = 0; to < outgoing_.size(); ++to) {
    {
      const std::lock_guard lock(mutex_);
      if (to == 0) has_outgoing_.store(false, std::memory_order_release);
      sending_.swap(outgoing_[to]);
    }
    Bytes packet;
    for (const Message& message : sending_) {
      if (packet.size() + message.payload.size() > kFullPacket) flush(to, packet);
      if (packet.empty()) {
        packet = begin_packet(PacketKind::kMessages);
        append_number(packet, colours_.colour());
      }
      colours_.note_sent(message.time);
      append_message(packet, message);
    }
    flush(to, packet);
    sending_.clear();
  }
}

void RankLink::flush(std::uint32_t to, Bytes& packet) {
  if (!packet.empty()) transport_.send(to, std::exchange(packet, {}));
}

void RankLink::send_records() {
  for (const Bytes& record : records_.take()) {
    Bytes packet = begin_packet(PacketKind::kRecord);
    packet.insert(packet.end(), record.begin(), record.end());
    if (!transport_.is_root()) {
      transport_.send(0, std::move(packet));
      continue;
    }
    for (std::uint32_t to = 1; to < transport_.size(); ++to) transport_.send(to, packet);
  }
}

void RankLink::receive(std::vector<Message>& messages) {
  while (const std::optional<Transport::Packet> packet = transport_.receive())
    take_in(*packet, messages);
}

void RankLink::take_in(const Transport::Packet& packet, std::vector<Message>& messages) {
  std::span<const std::byte> bytes(packet.bytes);
  switch (static_cast<PacketKind>(take_number<std::uint8_t>(bytes))) {
    case PacketKind::kRecord:
      records_.receive(bytes);
      return;
    case PacketKind::kEnd:
      ++ended_ranks_;
      return;
    case PacketKind::kMessages:
      break;
  }
  for (const auto colour = take_number<std::uint8_t>(bytes); !bytes.empty();) {
    messages.push_back(take_message(bytes));
    colours_.note_received(colour);
  }
}

void RankLink::contribute(VirtualTime floor, const std::optional<CommittedFault>& fault,
                          std::uint32_t stop) {
  GvtEstimate own = colours_.contribution(floor);
  own.stop = stop;
  if (fault) {
    own.fault_t = fault->when.t;
    own.fault_round = fault->when.round;
    own.fault_subject = fault->fault.subject;
    own.fault_lp = index_of(fault->lp);
  }
  transport_.start_reduction(own);
  reduces_.store(true, std::memory_order_release);
}

RankLink::Progress RankLink::look() {
  if (!reduces()) return Progress::kNone;
  const std::optional<GvtEstimate> sum = transport_.finished_reduction();
  if (!sum) return Progress::kNone;
  const bool is_gvt = colours_.conclude(*sum);
  reduces_.store(false, std::memory_order_release);
  if (!is_gvt) return Progress::kAgain;
  SODA_ASSERT(sum->floor() >= gvt_, "GVT went back from ", gvt_, " to ", sum->floor());
  gvt_ = sum->floor();
  stop_ = sum->stop;
  if (sum->fault_time() < gvt_)
    fault_ = {sum->fault_time(), LpId{sum->fault_lp}, {sum->fault_subject, {}}};
  return Progress::kNewGvt;
}

// The end comes last from each rank. After a fault or a stop, messages that no longer matter come
// before it.
void RankLink::close() {
  send_outgoing();
  for (std::uint32_t to = 0; to < transport_.size(); ++to)
    if (to != rank()) transport_.send(to, begin_packet(PacketKind::kEnd));
  std::vector<Message> late;
  while (ended_ranks_ + 1 < transport_.size()) {
    receive(late);
    std::this_thread::sleep_for(std::chrono::microseconds(20));
  }
  SODA_ASSERT(late.empty() || fault_ || stop_ != 0, late.size(), " messages after the end");
}

}  // namespace soda::kernel
