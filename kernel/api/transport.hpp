// What connects the ranks of a distributed run: the seam between the kernel and MPI.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "kernel/api/payload.hpp"
#include "kernel/api/virtual_time.hpp"

namespace soda::kernel {

// What ranks reduce to find GVT. Fixed layout without padding: it travels as bytes.
struct GvtEstimate {
  std::int64_t in_transit = 0;  // messages of the colour being counted: sent less received
  std::int64_t floor_t = kNever.t;
  std::int64_t fault_t = kNever.t;
  std::uint64_t fault_subject = 0;
  std::uint32_t floor_round = kNever.round;
  std::uint32_t fault_round = kNever.round;
  std::uint32_t fault_lp = 0;
  std::uint32_t stop = 0;  // a StopRequest

  VirtualTime floor() const { return {floor_t, floor_round}; }
  VirtualTime fault_time() const { return {fault_t, fault_round}; }
};
static_assert(sizeof(GvtEstimate) == 48);

// Sum of what is in transit, earliest floor, first fault, largest stop. Associative and
// commutative.
inline void combine(const GvtEstimate& from, GvtEstimate& into) {
  into.in_transit += from.in_transit;
  into.stop = std::max(into.stop, from.stop);
  if (from.floor() < into.floor()) {
    into.floor_t = from.floor_t;
    into.floor_round = from.floor_round;
  }
  const auto fault = [](const GvtEstimate& e) {
    return std::tuple(e.fault_time(), e.fault_subject, e.fault_lp);
  };
  if (fault(from) < fault(into)) {
    into.fault_t = from.fault_t;
    into.fault_round = from.fault_round;
    into.fault_subject = from.fault_subject;
    into.fault_lp = from.fault_lp;
  }
}

// All methods from one thread of each rank. Ranks are 0 .. size() - 1; rank 0 is the root. What
// fails in the network ends the job: there is nobody to recover with.
class Transport {
 public:
  struct Packet {
    std::uint32_t from = 0;
    Bytes bytes;
  };
  // The first rank that failed, and how.
  struct Agreement {
    std::uint32_t rank = 0;
    int code = 0;  // 0: nobody failed
  };

  virtual ~Transport() = default;
  virtual std::uint32_t rank() const = 0;
  virtual std::uint32_t size() const = 0;
  bool is_root() const { return rank() == 0; }

  // Does not wait. Packets of one pair of ranks arrive in the order of sending.
  virtual void send(std::uint32_t to, Bytes bytes) = 0;
  // A packet that has arrived, if any.
  virtual std::optional<Packet> receive() = 0;

  // A reduction with combine() over all ranks, one at a time: each rank starts it once, and then
  // asks until the result is there.
  virtual void start_reduction(const GvtEstimate& own) = 0;
  virtual std::optional<GvtEstimate> finished_reduction() = 0;

  // These wait until all ranks have called them, in the same order.
  virtual Agreement agree(int code) = 0;
  // The bytes of all ranks at the root, by rank; nothing elsewhere.
  virtual std::vector<Bytes> gather(const Bytes& bytes) = 0;

  // Ends the processes of all ranks with this exit code.
  [[noreturn]] virtual void abort(int code) = 0;

  // Whether this rank is in a run that the others are in, too: if an exception leaves it, they are
  // left waiting, and only abort() ends them.
  bool runs() const { return runs_; }
  void set_runs(bool runs) { runs_ = runs; }

 private:
  bool runs_ = false;
};

// Another rank has failed, and says why; this one has nothing to add.
struct PeerFailed {
  int code = 0;
};

// The symbol that the module with the MPI transport exports (mpi_transport.cpp). The program loads
// the module only when mpirun started it: loading and starting MPI costs half a second.
inline constexpr const char* kMpiTransportSymbol = "soda_start_mpi";
using StartMpi = Transport* (*)();  // the caller deletes it, which ends MPI

}  // namespace soda::kernel
