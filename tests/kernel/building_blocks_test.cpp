// The containers and small helpers of the kernel, against plain counterparts of the library.
#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "kernel/api/hash_mix.hpp"
#include "kernel/api/virtual_time.hpp"
#include "kernel/executors/worker.hpp"
#include "kernel/queues/inbox.hpp"
#include "kernel/queues/lp_heap.hpp"
#include "kernel/queues/sliding_vector.hpp"
#include "kernel/time_warp/copy_history.hpp"

namespace soda::kernel {
namespace {

TEST(VirtualTime, OrdersByCoarseTimeThenRound) {
  EXPECT_LT((VirtualTime{1, 9}), (VirtualTime{2, 0}));
  EXPECT_LT((VirtualTime{2, 0}), (VirtualTime{2, 1}));
  EXPECT_LT(kBeginning, (VirtualTime{-5, 0}));
  EXPECT_LT((VirtualTime{5, ~0u}), kNever);
}

TEST(SlidingVector, BehavesLikeADequeUnderRandomEdits) {
  SplitMix64 random(3);
  SlidingVector<std::string> sliding;
  std::deque<std::string> plain;
  for (int edit = 0; edit < 20000; ++edit) {
    const std::string item = std::to_string(edit);
    const std::size_t size = plain.size();
    const auto position = [&] { return static_cast<std::size_t>(random.below(size + 1)); };
    switch (random.below(8)) {
      case 0: {
        const std::size_t index = position();
        sliding.insert(index, item);
        plain.insert(plain.begin() + static_cast<std::ptrdiff_t>(index), item);
        break;
      }
      case 1: {
        const std::size_t count = std::min<std::size_t>(position(), 3);
        sliding.drop_front(count);
        plain.erase(plain.begin(), plain.begin() + static_cast<std::ptrdiff_t>(count));
        break;
      }
      case 2: {
        const std::size_t count = size - std::min<std::size_t>(position(), 1);
        sliding.truncate(count);
        plain.resize(count);
        break;
      }
      case 3: {
        const std::size_t first = position();
        const std::size_t last = std::min(first + 1, size);
        sliding.erase(first, last);
        plain.erase(plain.begin() + static_cast<std::ptrdiff_t>(first),
                    plain.begin() + static_cast<std::ptrdiff_t>(last));
        break;
      }
      default:
        sliding.push_back(item);
        plain.push_back(item);
    }
    ASSERT_TRUE(std::equal(sliding.begin(), sliding.end(), plain.begin(), plain.end()));
  }
  EXPECT_GT(plain.size(), 100u);
}

TEST(SlidingVector, ReleasesWhatDroppedElementsOwnAtOnce) {
  SlidingVector<std::shared_ptr<int>> sliding;
  const auto owned = std::make_shared<int>(1);
  for (int i = 0; i < 10; ++i) sliding.push_back(owned);
  sliding.drop_front(2);
  EXPECT_EQ(owned.use_count(), 9);
}

TEST(Inbox, KeepsWhatWasPutBeforeUntilItIsTaken) {
  Inbox inbox;
  const auto put = [&](std::vector<std::uint64_t> versions) {
    std::vector<Message> messages;
    for (const std::uint64_t version : versions) {
      messages.emplace_back();
      messages.back().version = version;
    }
    inbox.put(messages);
    EXPECT_TRUE(messages.empty());
  };
  std::vector<std::uint64_t> found;
  std::vector<Message> taken;
  const auto take = [&] {
    inbox.take(taken);
    EXPECT_FALSE(inbox.filled());
    found.clear();
    for (const Message& message : taken) found.push_back(message.version);
  };
  put({1, 2});
  put({3});
  EXPECT_TRUE(inbox.filled());
  take();
  EXPECT_EQ(found, (std::vector<std::uint64_t>{1, 2, 3}));
  put({4});
  put({5, 6});
  take();
  EXPECT_EQ(found, (std::vector<std::uint64_t>{1, 2, 3, 4, 5, 6})) << "taking appends";
}

TEST(LpHeap, TopIsTheEarliestAndAmongEqualsTheLowestNumber) {
  SplitMix64 random(4);
  LpHeap heap(50);
  std::set<std::pair<VirtualTime, std::uint32_t>> plain;
  for (std::uint32_t lp = 0; lp < 50; ++lp) plain.insert({kBeginning, lp});
  for (int change = 0; change < 20000; ++change) {
    const auto lp = static_cast<std::uint32_t>(random.below(50));
    const VirtualTime time{static_cast<std::int64_t>(random.below(20)), 0};
    plain.erase({heap.time_of(lp), lp});
    plain.insert({time, lp});
    heap.update(lp, time);
    ASSERT_EQ(heap.top(), plain.begin()->second);
    ASSERT_EQ(heap.top_time(), plain.begin()->first);
  }
}

TEST(CopyHistory, RewindsToTheNewestStateNotAfterTheTime) {
  CopyHistory<int> history;
  int state = 0;
  history.mark({5, 0}, state);
  history.mark({8, 0}, state = 1);
  history.mark({9, 2}, state = 2);
  state = 3;
  EXPECT_EQ(history.rewind({9, 1}, state), (VirtualTime{8, 0}));
  EXPECT_EQ(state, 1);
  EXPECT_EQ(history.size(), 2u);
  history.mark({8, 0}, state);
  EXPECT_EQ(history.size(), 2u);
  EXPECT_EQ(history.rewind({3, 0}, state), kBeginning) << "nothing ran before the first mark";
  EXPECT_EQ(state, 0);
}

TEST(CopyHistory, ForgetsWhatNoRewindCanReach) {
  CopyHistory<int> history;
  EXPECT_EQ(history.forget({7, 0}), kBeginning);
  for (int t = 0; t < 10; ++t) history.mark({t, 0}, t);
  EXPECT_EQ(history.forget({6, 3}), (VirtualTime{6, 0}));
  EXPECT_EQ(history.size(), 4u);
  int state = -1;
  EXPECT_EQ(history.rewind({6, 3}, state), (VirtualTime{6, 0}));
  EXPECT_EQ(state, 6);
}

TEST(SmallProcessDeathTest, SavesNothingByItself) {
  struct Counter final : SmallProcess<std::uint64_t> {
    VirtualTime next_time() const override { return kNever; }
    void execute(VirtualTime, std::span<const MessageView>, Outbox&) override { ++state_; }
    void commit(VirtualTime) override {}
  } counter;
  EXPECT_EQ(counter.state_bytes().size(), 8u);
  EXPECT_DEATH(counter.mark({3, 0}),
               "mark\\(\\(3, 0\\)\\) of an LP whose state the executor saves");
}

TEST(CopyHistoryDeathTest, RewindToAForgottenTimeAborts) {
  CopyHistory<int> history;
  for (int t = 0; t < 10; ++t) history.mark({t, 0}, t);
  history.forget({6, 0});
  int state = 0;
  EXPECT_DEATH(history.rewind({5, 9}, state), "rewind to \\(5, 9\\), which has been forgotten");
}

TEST(Partition, OwnerAndFirstAgreeAndRangesDifferByAtMostOne) {
  for (std::size_t lps = 1; lps <= 40; ++lps) {
    for (std::size_t workers = 1; workers <= lps; ++workers) {
      const Partition partition{lps, workers};
      EXPECT_EQ(partition.first_of(0), 0u);
      EXPECT_EQ(partition.first_of(workers), lps);
      for (std::size_t worker = 0; worker < workers; ++worker) {
        const std::size_t first = partition.first_of(worker);
        const std::size_t count = partition.first_of(worker + 1) - first;
        EXPECT_TRUE(count == lps / workers || count == lps / workers + 1);
        for (std::size_t lp = first; lp < first + count; ++lp)
          EXPECT_EQ(partition.owner_of(LpId{static_cast<std::uint32_t>(lp)}), worker);
      }
    }
  }
}

}  // namespace
}  // namespace soda::kernel
