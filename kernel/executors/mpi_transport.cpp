// Transport over MPI: the only file that knows MPI. A module of its own, loaded when needed.
#define OMPI_SKIP_MPICXX 1
#include <mpi.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <limits>

#include "kernel/api/transport.hpp"

namespace soda::kernel {
namespace {

constexpr int kTag = 1;

// MPI's default error handler ends the job with a message, so return codes say nothing new.
class MpiTransport final : public Transport {
 public:
  MpiTransport() {
    int provided = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
    if (provided < MPI_THREAD_FUNNELED) {
      std::fprintf(stderr, "soda: this MPI does not support threads\n");
      abort(3);
    }
    // Own communicators: what is reduced for GVT is never matched with what is agreed on.
    MPI_Comm_dup(MPI_COMM_WORLD, &messages_);
    MPI_Comm_dup(MPI_COMM_WORLD, &reductions_);
    MPI_Comm_rank(messages_, &rank_);
    MPI_Comm_size(messages_, &size_);
    MPI_Type_contiguous(sizeof(GvtEstimate), MPI_BYTE, &estimate_);
    MPI_Type_commit(&estimate_);
    MPI_Op_create(&MpiTransport::combine_all, 1, &combine_);
  }

  ~MpiTransport() override {
    for (Outgoing& outgoing : outgoing_) MPI_Wait(&outgoing.request, MPI_STATUS_IGNORE);
    MPI_Op_free(&combine_);
    MPI_Type_free(&estimate_);
    MPI_Comm_free(&messages_);
    MPI_Comm_free(&reductions_);
    MPI_Finalize();
  }

  std::uint32_t rank() const override { return static_cast<std::uint32_t>(rank_); }
  std::uint32_t size() const override { return static_cast<std::uint32_t>(size_); }

  void send(std::uint32_t to, Bytes bytes) override {
    release_sent();
    Outgoing& outgoing = outgoing_.emplace_back();
    outgoing.bytes = std::move(bytes);
    MPI_Isend(outgoing.bytes.data(), count_of(outgoing.bytes), MPI_BYTE, static_cast<int>(to), kTag,
              messages_, &outgoing.request);
  }

  std::optional<Packet> receive() override {
    int here = 0;
    MPI_Message message;
    MPI_Status status;
    MPI_Improbe(MPI_ANY_SOURCE, kTag, messages_, &here, &message, &status);
    if (here == 0) {
      release_sent();
      return std::nullopt;
    }
    int count = 0;
    MPI_Get_count(&status, MPI_BYTE, &count);
    Packet packet{static_cast<std::uint32_t>(status.MPI_SOURCE),
                  Bytes(static_cast<std::size_t>(count))};
    MPI_Mrecv(packet.bytes.data(), count, MPI_BYTE, &message, MPI_STATUS_IGNORE);
    return packet;
  }

  void start_reduction(const GvtEstimate& own) override {
    own_ = own;
    MPI_Iallreduce(&own_, &sum_, 1, estimate_, combine_, reductions_, &reduction_);
  }

  std::optional<GvtEstimate> finished_reduction() override {
    if (reduction_ == MPI_REQUEST_NULL) return std::nullopt;
    int done = 0;
    MPI_Test(&reduction_, &done, MPI_STATUS_IGNORE);
    return done != 0 ? std::optional(sum_) : std::nullopt;
  }

  Agreement agree(int code) override {
    const int own = code == 0 ? std::numeric_limits<int>::max() : rank_;
    int first = 0;
    MPI_Allreduce(&own, &first, 1, MPI_INT, MPI_MIN, messages_);
    if (first == std::numeric_limits<int>::max()) return {};
    MPI_Bcast(&code, 1, MPI_INT, first, messages_);
    return {static_cast<std::uint32_t>(first), code};
  }

  std::vector<Bytes> gather(const Bytes& bytes) override {
    const int own = count_of(bytes);
    std::vector<int> counts(static_cast<std::size_t>(size_)), starts(counts.size());
    MPI_Gather(&own, 1, MPI_INT, counts.data(), 1, MPI_INT, 0, messages_);
    std::size_t total = 0;
    for (std::size_t i = 0; i < counts.size(); ++i) {
      starts[i] = static_cast<int>(total);
      total += static_cast<std::size_t>(counts[i]);
    }
    require_int(total);
    Bytes all(rank_ == 0 ? total : 0);
    MPI_Gatherv(bytes.data(), own, MPI_BYTE, all.data(), counts.data(), starts.data(), MPI_BYTE, 0,
                messages_);
    std::vector<Bytes> parts;
    for (std::size_t i = 0; rank_ == 0 && i < counts.size(); ++i)
      parts.emplace_back(all.begin() + starts[i], all.begin() + starts[i] + counts[i]);
    return parts;
  }

  [[noreturn]] void abort(int code) override {
    MPI_Abort(MPI_COMM_WORLD, code);
    std::abort();
  }

 private:
  struct Outgoing {
    Bytes bytes;
    MPI_Request request = MPI_REQUEST_NULL;
  };

  // MPI fixes the types.
  // NOLINTNEXTLINE(readability-non-const-parameter)
  static void combine_all(void* from, void* into, int* count, MPI_Datatype*) {
    for (int i = 0; i < *count; ++i)
      combine(static_cast<const GvtEstimate*>(from)[i], static_cast<GvtEstimate*>(into)[i]);
  }

  static void require_int(std::size_t bytes) {
    if (bytes <= static_cast<std::size_t>(std::numeric_limits<int>::max())) return;
    std::fprintf(stderr, "soda: %zu bytes are too many for one MPI call\n", bytes);
    MPI_Abort(MPI_COMM_WORLD, 70);
    std::abort();
  }

  static int count_of(const Bytes& bytes) {
    require_int(bytes.size());
    return static_cast<int>(bytes.size());
  }

  // In order: what was sent first is most likely to have left.
  void release_sent() {
    while (!outgoing_.empty()) {
      int done = 0;
      MPI_Test(&outgoing_.front().request, &done, MPI_STATUS_IGNORE);
      if (done == 0) return;
      outgoing_.pop_front();
    }
  }

  MPI_Comm messages_ = MPI_COMM_NULL, reductions_ = MPI_COMM_NULL;
  MPI_Datatype estimate_ = MPI_DATATYPE_NULL;
  MPI_Op combine_ = MPI_OP_NULL;
  int rank_ = 0, size_ = 1;
  std::deque<Outgoing> outgoing_;  // the request of an element must not move
  MPI_Request reduction_ = MPI_REQUEST_NULL;
  GvtEstimate own_, sum_;  // of the reduction under way
};

}  // namespace
}  // namespace soda::kernel

extern "C" soda::kernel::Transport* soda_start_mpi() { return new soda::kernel::MpiTransport; }
