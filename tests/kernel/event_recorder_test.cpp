// What a recorder writes, a chunk reads back.
#include "kernel/api/event_recorder.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <vector>

namespace soda::kernel {
namespace {

struct Chunks final : TraceSink {
  void take(Bytes chunk) override { all.push_back(std::move(chunk)); }
  std::vector<Bytes> all;
};

std::uint8_t by_round(VirtualTime time) { return static_cast<std::uint8_t>(time.round); }
void describe(std::uint32_t kind, std::span<const std::byte>, Bytes& note) {
  note.assign(3, std::byte(kind));
}

TEST(EventRecorder, WhatItWritesReadsBack) {
  Chunks chunks;
  EventRecorder recorder({by_round, &chunks, describe}, 77);
  recorder.set_clock(1'000'000'000'000);
  const VirtualTime far{std::numeric_limits<std::int64_t>::max(), 0xffff'ffffu};
  const Message message({{-5, 7}, LpId{0xffff'fffeu}, 9, 2}, LpId{3}, 1ull << 61, true, {});
  recorder.sent(message, far);
  recorder.set_clock(-12);
  recorder.late(message);
  recorder.executed(LpId{4}, far, -40, true);
  recorder.cost(LpId{4}, 123);
  recorder.rewound(LpId{4}, {1, 2}, kBeginning, {5, ~0ull, 6});
  recorder.gvt(kNever);
  recorder.flush(true);
  ASSERT_EQ(chunks.all.size(), 1u);
  TraceChunk chunk(chunks.all[0]);
  EXPECT_EQ(chunk.worker(), 77u);
  std::vector<TraceRecord> records;
  for (TraceRecord record; chunk.next(record);) records.push_back(record);
  EXPECT_TRUE(chunk.is_sound());
  ASSERT_EQ(records.size(), 6u);
  EXPECT_EQ(records[0].what, Happening::kSent);
  EXPECT_EQ(records[0].clock_ns, 1'000'000'000'000);
  EXPECT_EQ(records[0].lp, LpId{3});
  EXPECT_EQ(records[0].peer, LpId{0xffff'fffeu});
  EXPECT_EQ(records[0].time, (VirtualTime{-5, 7}));
  EXPECT_EQ(records[0].other, far);
  EXPECT_EQ(records[0].version, 1ull << 61);
  EXPECT_TRUE(records[0].anti);
  EXPECT_EQ(records[1].what, Happening::kLate);
  EXPECT_EQ(records[1].clock_ns, -12);
  EXPECT_EQ(records[1].lp, LpId{0xffff'fffeu});
  EXPECT_EQ(records[1].note.size(), 3u);
  EXPECT_EQ(records[2].time, far);
  EXPECT_EQ(records[2].clock_ns, -40);
  EXPECT_TRUE(records[2].anew);
  EXPECT_EQ(records[3].took_ns, 123);
  EXPECT_EQ(records[4].other, kBeginning);
  EXPECT_EQ(records[4].note.size(), 20u);
  EXPECT_EQ(records[5].time, kNever);
  EXPECT_EQ(recorder.counts().messages[9].anti, 1u);
  EXPECT_EQ(recorder.counts().messages[9].late, 1u);
  EXPECT_EQ(recorder.counts().executions[EventCounts::kMostKinds - 1].executed, 1u);
}

// Cut anywhere, or with any byte changed: it ends, and never reads beyond.
TEST(EventRecorder, ADamagedChunkEnds) {
  Chunks chunks;
  EventRecorder recorder({by_round, &chunks, describe}, 1);
  const Message message({{5, 7}, LpId{2}, 1, 0}, LpId{3}, 600, false, Payload(Bytes(9)));
  for (int i = 0; i < 20; ++i) {
    recorder.sent(message, {4, 0});
    recorder.late(message);
    recorder.rolled_back(LpId{2}, {9, 1});
  }
  recorder.flush(true);
  std::mt19937 random(3);
  for (int trial = 0; trial < 2000; ++trial) {
    Bytes bytes = chunks.all[0];
    if (trial % 2 == 0)
      bytes.resize(random() % bytes.size());
    else
      bytes[random() % bytes.size()] ^= std::byte(1 + random() % 255);
    TraceChunk chunk(bytes);
    std::size_t records = 0;
    for (TraceRecord record; chunk.next(record); ++records)
      ASSERT_LT(static_cast<std::uint8_t>(record.what), kHappenings);
    EXPECT_LE(records, bytes.size());
  }
}

TEST(EventRecorder, WithoutASinkItOnlyCounts) {
  EventRecorder recorder({by_round, nullptr}, 0);
  recorder.executed(LpId{0}, {0, 2}, 0, false);
  recorder.rolled_back(LpId{0}, {0, 2});
  recorder.put_back(LpId{0}, {0, 2});
  recorder.committed(LpId{0}, {0, 2});
  EXPECT_EQ(recorder.counts().executions[2].executed, 1u);
  EXPECT_EQ(recorder.counts().executions[2].rolled_back, 0u);
  EXPECT_EQ(recorder.counts().executions[2].committed, 1u);
}

}  // namespace
}  // namespace soda::kernel
