// Committed parts that travel as bytes: what the root makes of them.
#include "models/run/commit_forwarding.hpp"

#include <gtest/gtest.h>

#include <utility>

namespace soda::models {
namespace {

using physics::BodyId;
using physics::Vec3;

// Bodies 2 w and 2 w + 1 of world w, at places that tell the step.
BufferEntry entry_of(std::int64_t step, std::uint32_t world) {
  BufferEntry entry;
  entry.step = step;
  for (const std::uint32_t body : {2 * world, 2 * world + 1}) {
    entry.ids.push_back(BodyId{body});
    entry.states.emplace_back();
    entry.states.back().position_m = Vec3(body, static_cast<double>(step), -0.0);
  }
  entry.states[0].impulses.emplace_back();
  entry.states[0].impulses[0].normal_newton_s = 0.5;
  entry.islands.emplace_back();
  entry.islands[0].label = BodyId{2 * world};
  return entry;
}

// From the rank of `forwarding` to one that has `sinks`; returns how many records there were.
std::size_t send_all(CommitForwarding& forwarding, const RecordSinks& own,
                     const RecordSinks& sinks) {
  const CommitObserver nothing;
  CommitForwarding unused(nothing);
  const kernel::RecordHooks from = record_hooks(forwarding, own), to = record_hooks(unused, sinks);
  const std::vector<kernel::Bytes> records = from.take();
  for (const kernel::Bytes& record : records) to.receive(record);
  return records.size();
}

struct Nobody final : CommitSink {
  void add(WorldId, const BufferEntry&) override { FAIL(); }
};

TEST(CommitForwarding, TheRootHasStepsInOrderWithStatesOwnersAndIslandsOfAllWorlds) {
  std::int64_t last = 0;
  const CommitObserver observer{
      .wants_states = true, .on_step = [&](const CommittedStep& step) {
        EXPECT_EQ(step.step, ++last);
        ASSERT_EQ(step.ids.size(), 6u);
        ASSERT_EQ(step.islands.size(), 3u);
        for (std::uint32_t body = 0; body < 6; ++body) {
          const BufferEntry entry = entry_of(step.step, body / 2);
          EXPECT_EQ(step.ids[body], BodyId{body});
          EXPECT_EQ(step.owners[body], WorldId{body / 2});
          EXPECT_TRUE(identical(step.states[body], entry.states[body % 2])) << body;
          EXPECT_EQ(step.islands[body / 2].label, BodyId{body / 2 * 2});
        }
      }};
  CommitMerge merge(observer, 3);
  CommitForwarding forwarding(observer);
  for (std::int64_t step = 1; step <= 3; ++step) merge.add(WorldId{1}, entry_of(step, 1));
  for (std::int64_t step = 1; step <= 3; ++step)
    for (const std::uint32_t world : {2u, 0u})
      forwarding.add(WorldId{world}, entry_of(step, world));
  EXPECT_EQ(send_all(forwarding, {forwarding}, {merge}), 6u);
  EXPECT_EQ(last, 3);
  EXPECT_EQ(send_all(forwarding, {forwarding}, {merge}), 0u) << "each record is taken once";
}

TEST(CommitForwarding, StatesThatNobodyWantsDoNotTravelButIslandsDo) {
  struct Last final : CommitSink {
    void add(WorldId, const BufferEntry& entry) override { part = entry; }
    BufferEntry part;
  } last;
  const CommitObserver nobody;
  CommitForwarding forwarding(nobody);
  forwarding.add(WorldId{1}, entry_of(4, 1));
  send_all(forwarding, {forwarding}, {last});
  EXPECT_EQ(last.part.step, 4);
  EXPECT_TRUE(last.part.ids.empty());
  EXPECT_EQ(last.part.islands.size(), 1u);
}

TEST(CommitForwarding, TracesComeAsTheyAre) {
  struct Chunks final : kernel::TraceSink {
    void take(kernel::Bytes chunk) override { all.push_back(std::move(chunk)); }
    std::vector<kernel::Bytes> all;
  } chunks;
  Nobody nobody;
  const std::vector<kernel::Bytes> sent = {kernel::Bytes(7, std::byte{9}), kernel::Bytes{}};
  const CommitObserver observer;
  CommitForwarding forwarding(observer);
  for (const kernel::Bytes& chunk : sent) forwarding.take(chunk);
  send_all(forwarding, {forwarding}, {.commits = nobody, .trace = &chunks});
  EXPECT_EQ(chunks.all, sent);
}

TEST(CommitForwarding, NewsOfOneObserverIsHeardByTheOtherEvenIfItIsEmpty) {
  struct Observer final : EntryObserver {
    void on_newest(WorldId, std::int64_t) override {}
    std::vector<kernel::Bytes> take_news() override { return std::exchange(says, {}); }
    void receive(std::span<const std::byte> news) override {
      received.emplace_back(news.begin(), news.end());
    }
    std::vector<kernel::Bytes> says, received;
  } here, there;
  const std::vector<kernel::Bytes> said = {kernel::Bytes(3, std::byte{7}), kernel::Bytes{}};
  here.says = said;
  Nobody nobody;
  const CommitObserver observer;
  CommitForwarding forwarding(observer);
  send_all(forwarding, {.commits = forwarding, .entries = &here},
           {.commits = nobody, .entries = &there});
  EXPECT_EQ(there.received, said);
  EXPECT_TRUE(here.received.empty());
}

}  // namespace
}  // namespace soda::models
