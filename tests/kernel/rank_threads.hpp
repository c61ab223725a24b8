// Ranks as threads of one process, over a network that delays and is checked: the distributed
// executor without MPI.
#pragma once

#include <gtest/gtest.h>

#include <condition_variable>
#include <cstdlib>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <thread>
#include <vector>

#include "kernel/api/hash_mix.hpp"
#include "kernel/api/transport.hpp"
#include "kernel/executors/distributed_executor.hpp"

namespace soda::kernel {

class RankThreads {
 public:
  // A packet arrives after up to `most_looks` looks of its receiver; the seed draws how many.
  RankThreads(std::uint32_t ranks, std::uint64_t seed, std::uint64_t most_looks = 12) {
    for (std::uint32_t rank = 0; rank < ranks; ++rank)
      ends_.push_back(std::make_unique<End>(*this, rank, append(seed, rank), most_looks));
    gathered_.resize(ranks);
  }

  Transport& end(std::uint32_t rank) { return *ends_[rank]; }

  // All ranks on the same LPs, of which each touches its own only. The root's result.
  static RunResult run(std::uint32_t ranks, std::span<const std::unique_ptr<LogicalProcess>> lps,
                       VirtualTime until, const ThreadsOptions& options,
                       const ProgressFn& progress = {}) {
    RankThreads network(ranks, options.scheduling_seed + 1);
    std::vector<RunResult> results(ranks);
    {
      std::vector<std::jthread> threads;
      for (std::uint32_t rank = 0; rank < ranks; ++rank)
        threads.emplace_back([&, rank] {
          results[rank] = run_distributed(lps, until, options, network.end(rank), {},
                                          rank == 0 ? progress : ProgressFn{});
        });
    }
    for (const RunResult& result : results)
      EXPECT_EQ(result.fault.has_value(), results[0].fault.has_value());
    for (std::uint32_t rank = 0; rank < ranks; ++rank)
      EXPECT_FALSE(network.ends_[rank]->has_packets()) << "rank " << rank;
    return results[0];
  }

 private:
  class End final : public Transport {
   public:
    End(RankThreads& network, std::uint32_t rank, std::uint64_t seed, std::uint64_t most_looks)
        : network_(network), rank_(rank), random_(seed), most_looks_(most_looks) {}

    std::uint32_t rank() const override { return rank_; }
    std::uint32_t size() const override {
      return static_cast<std::uint32_t>(network_.ends_.size());
    }

    void send(std::uint32_t to, Bytes bytes) override {
      End& other = *network_.ends_[to];
      const std::lock_guard lock(other.mutex_);
      other.packets_.push_back({{rank_, std::move(bytes)}, other.random_.below(most_looks_ + 1)});
    }

    // Any packet that is due and first of its sender.
    std::optional<Packet> receive() override {
      const std::lock_guard lock(mutex_);
      std::vector<char> passed(size(), false);
      for (auto place = packets_.begin(); place != packets_.end(); ++place) {
        char& held = passed[place->packet.from];
        if (!held && place->looks_left == 0) {
          Packet packet = std::move(place->packet);
          packets_.erase(place);
          return packet;
        }
        held = true;
        if (place->looks_left > 0) --place->looks_left;
      }
      return std::nullopt;
    }

    void start_reduction(const GvtEstimate& own) override {
      const std::lock_guard lock(network_.mutex_);
      network_.reductions_.resize(std::max(network_.reductions_.size(), reduction_ + 1));
      Reduction& reduction = network_.reductions_[reduction_];
      if (reduction.ranks++ == 0)
        reduction.sum = own;
      else
        combine(own, reduction.sum);
      waits_ = true;
    }

    std::optional<GvtEstimate> finished_reduction() override {
      const std::lock_guard lock(network_.mutex_);
      if (!waits_ || network_.reductions_[reduction_].ranks < size()) return std::nullopt;
      waits_ = false;
      return network_.reductions_[reduction_++].sum;
    }

    Agreement agree(int code) override {
      network_.meet([&] { network_.agreement_ = {}; },
                    [&] {
                      Agreement& all = network_.agreement_;
                      if (code != 0 && (all.code == 0 || rank_ < all.rank)) all = {rank_, code};
                    });
      const Agreement all = network_.agreement_;
      network_.meet([] {}, [] {});
      return all;
    }

    std::vector<Bytes> gather(const Bytes& bytes) override {
      network_.meet([] {}, [&] { network_.gathered_[rank_] = bytes; });
      const std::vector<Bytes> all = rank_ == 0 ? network_.gathered_ : std::vector<Bytes>{};
      network_.meet([] {}, [] {});  // nobody may gather again before the root has copied
      return all;
    }

    [[noreturn]] void abort(int code) override { std::exit(code); }

    bool has_packets() const { return !packets_.empty(); }

   private:
    struct Travelling {
      Packet packet;
      std::uint64_t looks_left;
    };
    RankThreads& network_;
    const std::uint32_t rank_;
    SplitMix64 random_;
    const std::uint64_t most_looks_;
    std::mutex mutex_;
    std::deque<Travelling> packets_;
    std::size_t reduction_ = 0;  // number of the current or next one
    bool waits_ = false;
  };
  struct Reduction {
    std::uint32_t ranks = 0;
    GvtEstimate sum;
  };

  // All ranks: the first does `begin`, each its `part`; nobody leaves before all have done theirs.
  template <class Begin, class Part>
  void meet(const Begin& begin, const Part& part) {
    std::unique_lock lock(mutex_);
    if (arrived_ == 0) begin();
    part();
    const std::uint64_t meeting = meetings_;
    if (++arrived_ == ends_.size()) {
      arrived_ = 0;
      ++meetings_;
      over_.notify_all();
    } else {
      over_.wait(lock, [&] { return meetings_ != meeting; });
    }
  }

  std::vector<std::unique_ptr<End>> ends_;
  std::mutex mutex_;
  std::condition_variable over_;
  std::vector<Reduction> reductions_;
  std::size_t arrived_ = 0;
  std::uint64_t meetings_ = 0;
  Transport::Agreement agreement_;
  std::vector<Bytes> gathered_;
};

}  // namespace soda::kernel
