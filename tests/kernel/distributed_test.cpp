// Time Warp over ranks that share nothing but a transport.
#include <gtest/gtest.h>

#include <numeric>

#include "kernel/api/wire.hpp"
#include "kernel/gvt/colour_count.hpp"
#include "kernel/phold/phold.hpp"
#include "tests/kernel/rank_threads.hpp"

namespace soda::kernel {
namespace {

GvtEstimate sum_of(std::initializer_list<GvtEstimate> estimates) {
  GvtEstimate sum;
  for (const GvtEstimate& estimate : estimates) combine(estimate, sum);
  return sum;
}

TEST(ColourCount, AMessageInTransitHoldsBackGvtUntilItHasArrived) {
  ColourCount sender, receiver;
  const std::uint8_t colour = sender.colour();
  sender.note_sent({5, 0});
  const GvtEstimate first = sum_of({sender.contribution({9, 0}), receiver.contribution({8, 0})});
  EXPECT_EQ(first.in_transit, 1);
  EXPECT_FALSE(sender.conclude(first));
  EXPECT_FALSE(receiver.conclude(first));
  receiver.note_received(colour);
  const GvtEstimate second = sum_of({sender.contribution({9, 0}), receiver.contribution({5, 0})});
  EXPECT_TRUE(receiver.conclude(second));
  EXPECT_EQ(second.floor(), (VirtualTime{5, 0}));
}

TEST(ColourCount, WhatIsSentBetweenTheCutsCountsWithItsTime) {
  ColourCount a, b;
  a.note_sent({5, 0});
  const std::uint8_t old_colour = b.colour();
  const GvtEstimate first = sum_of({a.contribution({9, 0}), b.contribution({9, 0})});
  EXPECT_NE(a.colour(), old_colour);
  a.note_sent({6, 1});  // does not arrive
  b.note_received(old_colour);
  a.conclude(first);
  b.conclude(first);
  const GvtEstimate second = sum_of({a.contribution({9, 0}), b.contribution({7, 0})});
  EXPECT_TRUE(a.conclude(second));
  EXPECT_EQ(second.floor(), (VirtualTime{6, 1}));
}

TEST(ColourCount, AMessageOfTheNewColourMayComeBeforeItsReceiverKnowsOfIt) {
  ColourCount early, late;
  const GvtEstimate from_early = early.contribution({9, 0});
  early.note_sent({6, 0});
  late.note_received(early.colour());
  const GvtEstimate sum = sum_of({from_early, late.contribution({6, 0})});
  EXPECT_EQ(sum.in_transit, 0);
  EXPECT_EQ(sum.floor(), (VirtualTime{6, 0}));
}

TEST(Wire, AMessageComesBackWithEveryField) {
  for (const std::size_t size : {0u, 1u, 20u, 21u, 70'000u}) {
    Message message;
    message.time = {-7, 3};
    message.source = LpId{4};
    message.destination = LpId{5};
    message.kind = 6;
    message.slot = 7;
    message.version = (std::uint64_t{1} << 61) + 8;
    message.anti = size == 0;
    message.first = size == 1;
    message.payload = Payload(Bytes(size, std::byte{42}));
    Bytes bytes;
    append_message(bytes, message);
    append_message(bytes, message);
    std::span<const std::byte> left(bytes);
    for (int copy = 0; copy < 2; ++copy) {
      const Message found = take_message(left);
      EXPECT_EQ(message_id(found), message_id(message));
      EXPECT_EQ(found.destination, message.destination);
      EXPECT_EQ(found.version, message.version);
      EXPECT_EQ(found.anti, message.anti);
      EXPECT_EQ(found.first, message.first);
      EXPECT_EQ(found.payload, message.payload);
    }
    EXPECT_TRUE(left.empty());
  }
}

TEST(Distributed, RanksOwnAllLpsOnce) {
  for (const std::uint32_t ranks : {1u, 2u, 3u, 4u})
    for (const std::size_t lps : {0u, 1u, 3u, 7u, 100u}) {
      RankThreads network(ranks, 1);
      std::uint32_t next = 0;
      for (std::uint32_t rank = 0; rank < ranks; ++rank) {
        const LpRange own = own_lps(network.end(rank), 2, lps);
        EXPECT_EQ(own.first, next);
        next = own.last;
      }
      EXPECT_EQ(next, lps);
    }
}

// Slow and fast networks, against the sequential run, with rollbacks over the network.
TEST(Distributed, OrderSensitivePholdCommitsTheSequentialTrace) {
  std::uint64_t rollbacks = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const PholdOptions model{.lps = 12,
                             .start_events_per_lp = 2,
                             .remote_per_mille = 500,
                             .zero_delay_rounds = 2,
                             .doubled_per_mille = 200,
                             .seed = seed};
    const auto oracle = make_phold(model);
    const RunResult expected = run_sequential(oracle, {80, 0});
    for (const std::uint32_t ranks : {1u, 2u, 3u, 4u}) {
      for (const std::uint64_t scheduling_seed : {std::uint64_t{0}, seed}) {
        const auto lps = make_phold(model);
        const RunResult found = RankThreads::run(ranks, lps, {80, 0},
                                                 {.threads = 1 + static_cast<unsigned>(seed % 2),
                                                  .window = 10,
                                                  .scheduling_seed = scheduling_seed});
        ASSERT_EQ(phold_digest(lps), phold_digest(oracle))
            << "seed " << seed << ", ranks " << ranks << ", scheduling seed " << scheduling_seed;
        EXPECT_EQ(found.counters.committed, expected.counters.committed);
        rollbacks += found.counters.rollbacks;
      }
    }
  }
  EXPECT_GT(rollbacks, 0u);
}

TEST(Distributed, LockstepRollsNothingBack) {
  const PholdOptions model{.lps = 8, .remote_per_mille = 500, .zero_delay_rounds = 1};
  const auto oracle = make_phold(model);
  run_sequential(oracle, {60, 0});
  const auto lps = make_phold(model);
  const RunResult found = RankThreads::run(
      3, lps, {60, 0}, {.threads = 2, .window = 8, .synchronisation = Synchronisation::kLockstep});
  EXPECT_EQ(phold_digest(lps), phold_digest(oracle));
  EXPECT_EQ(found.counters.rollbacks, 0u);
}

TEST(Distributed, CheckpointsAreBoundedByTheWindowHoweverLongTheRun) {
  const PholdOptions model{
      .lps = 8, .start_events_per_lp = 4, .remote_per_mille = 500, .zero_delay_rounds = 2};
  for (const std::int64_t window : {1, 6})
    for (const std::uint64_t seed : {0, 1}) {
      const auto lps = make_phold(model);
      const RunResult result = RankThreads::run(
          2, lps, {600, 0}, {.threads = 2, .window = window, .scheduling_seed = seed});
      EXPECT_GT(result.counters.committed, 5000u);
      const auto rounds_per_tick = static_cast<std::size_t>(model.zero_delay_rounds) + 1;
      EXPECT_LE(phold_checkpoints(lps), static_cast<std::size_t>(window) * rounds_per_tick + 1);
    }
}

// Records arrive whole, in the order of each rank, and none is missing at the end.
TEST(Distributed, RecordsGoFromAllRanksToTheRootAndFromTheRootToAllInOrder) {
  constexpr std::uint32_t kRanks = 3;
  RankThreads network(kRanks, 5);
  const auto lps = make_phold({.lps = 6});
  std::vector<std::vector<std::uint32_t>> found(kRanks);  // at the root, of each rank
  std::vector<std::vector<std::uint32_t>> heard(kRanks);  // at each rank, of the root
  std::vector<std::jthread> threads;
  for (std::uint32_t rank = 0; rank < kRanks; ++rank)
    threads.emplace_back([&, rank] {
      RecordHooks hooks;
      std::uint32_t next = 0;
      hooks.take = [&] {
        std::vector<Bytes> records(next < 40 ? 2 : 0);
        for (Bytes& record : records) {
          append_number(record, rank);
          append_number(record, next++);
        }
        return records;
      };
      hooks.receive = [&](std::span<const std::byte> bytes) {
        const auto from = take_number<std::uint32_t>(bytes);
        EXPECT_TRUE(rank == 0 || from == 0) << "from " << from << " to " << rank;
        (rank == 0 ? found[from] : heard[rank]).push_back(take_number<std::uint32_t>(bytes));
      };
      run_distributed(lps, {200, 0}, {.window = 5}, network.end(rank), hooks);
      EXPECT_EQ(next, 40u);
    });
  threads.clear();
  std::vector<std::uint32_t> all(40);
  std::iota(all.begin(), all.end(), 0);
  for (std::uint32_t rank = 1; rank < kRanks; ++rank) {
    EXPECT_EQ(found[rank], all) << "from " << rank;
    EXPECT_EQ(heard[rank], all) << "to " << rank;
  }
}

TEST(Distributed, AFailureOfOneRankBeforeTheRunEndsAll) {
  RankThreads network(3, 1);
  const auto lps = make_phold({.lps = 6});
  std::vector<std::jthread> threads;
  for (std::uint32_t rank = 0; rank < 3; ++rank)
    threads.emplace_back([&, rank] {
      if (rank == 1) {
        EXPECT_EQ(network.end(rank).agree(3).rank, 1u);
        return;
      }
      try {
        run_distributed(lps, {9, 0}, {}, network.end(rank));
        ADD_FAILURE() << "rank " << rank << " ran";
      } catch (const PeerFailed& failure) {
        EXPECT_EQ(failure.code, 3);
      }
    });
}

}  // namespace
}  // namespace soda::kernel
