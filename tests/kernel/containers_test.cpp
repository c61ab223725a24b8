// Payloads, queues and tables that the executors are built on, against plain counterparts.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "kernel/api/hash_mix.hpp"
#include "kernel/api/payload.hpp"
#include "kernel/phold/standard_phold.hpp"
#include "kernel/queues/calendar_queue.hpp"
#include "kernel/queues/four_ary_heap.hpp"
#include "kernel/queues/message_calendar.hpp"
#include "kernel/queues/message_pool.hpp"
#include "kernel/queues/slot_table.hpp"
#include "kernel/time_warp/copy_history.hpp"

namespace soda::kernel {
namespace {

Bytes bytes_of_length(std::size_t length) {
  Bytes bytes(length);
  for (std::size_t i = 0; i < length; ++i) bytes[i] = static_cast<std::byte>(i + length);
  return bytes;
}

TEST(Payload, KeepsItsBytesThroughCopiesMovesAndAssignments) {
  const std::size_t lengths[] = {0, 1, Payload::kInlineBytes, Payload::kInlineBytes + 1, 5000};
  for (const std::size_t length : lengths) {
    for (const std::size_t other_length : lengths) {
      const Bytes bytes = bytes_of_length(length);
      const auto holds = [&](const Payload& payload) {
        return std::equal(payload.bytes().begin(), payload.bytes().end(), bytes.begin(),
                          bytes.end());
      };
      Payload first(bytes);
      Payload copy = first;
      EXPECT_TRUE(holds(first) && holds(copy) && first == copy);
      Payload assigned(bytes_of_length(other_length));
      EXPECT_EQ(assigned == first, length == other_length);
      assigned = first;
      EXPECT_TRUE(holds(assigned));
      Payload moved = std::move(first);
      EXPECT_TRUE(holds(moved));
      assigned = Payload(bytes_of_length(other_length));
      assigned = std::move(moved);
      EXPECT_TRUE(holds(assigned) && holds(copy));
      assigned.clear();
      EXPECT_TRUE(assigned.empty() && holds(copy));
    }
  }
}

TEST(Payload, SharesWhatDoesNotFitAndCopiesWhatDoes) {
  const Payload large(bytes_of_length(100));
  const Payload large_copy = large;
  EXPECT_EQ(large.bytes().data(), large_copy.bytes().data());
  const Payload small(bytes_of_length(8));
  const Payload small_copy = small;
  EXPECT_NE(small.bytes().data(), small_copy.bytes().data());
}

// Times as of PHOLD; all at one; few and far apart; going back; and growing without bound.
std::int64_t draw_time(int style, std::int64_t now, SplitMix64& random) {
  switch (style) {
    case 0:
      return now + 1 + static_cast<std::int64_t>(random.below(2'000'000));
    case 1:
      return now;
    case 2:
      return now + (std::int64_t{1} << (20 + random.below(30)));
    case 3:
      return now - 500 + static_cast<std::int64_t>(random.below(1000));
    default:
      return now + static_cast<std::int64_t>(random.below(4));
  }
}

TEST(CalendarQueue, TakesOutTheEarliestWhateverTheTimesAreLike) {
  using Queue = CalendarQueue<std::uint64_t>;
  SplitMix64 random(7);
  Queue queue;
  std::vector<std::uint64_t> values;
  std::multimap<std::tuple<std::int64_t, std::uint32_t, std::uint32_t>, std::uint64_t> plain;
  std::int64_t now = -1000;
  std::size_t most = 0;
  for (int phase = 0; phase < 60; ++phase) {
    const int style = static_cast<int>(random.below(5));
    const std::size_t target = random.below(phase % 3 == 0 ? 5000 : 60);
    for (int change = 0; change < (target > 60 ? 12000 : 1000); ++change) {
      if (plain.empty() || (plain.size() < target ? random.below(4) > 0 : random.below(4) == 0)) {
        const Queue::Key key{draw_time(style, now, random),
                             static_cast<std::uint32_t>(random.below(3)),
                             static_cast<std::uint32_t>(random.below(50))};
        const std::uint64_t value = random.next();
        queue.push(key, value);
        plain.emplace(std::tuple(key.t, key.round, key.lp), value);
      } else {
        const Queue::Key key = queue.top();
        const auto first = plain.begin()->first;
        ASSERT_EQ(std::tuple(key.t, key.round, key.lp), first);
        now = key.t;
        values.clear();
        queue.pop(values);
        const std::uint64_t value = values.front();
        const auto [begin, end] = plain.equal_range(first);
        const auto found =
            std::find_if(begin, end, [&](const auto& entry) { return entry.second == value; });
        ASSERT_NE(found, end);
        plain.erase(found);
      }
      ASSERT_EQ(queue.size(), plain.size());
      most = std::max(most, plain.size());
    }
  }
  EXPECT_GT(most, 2000u);
}

// As an LP does that sends while it reads its bag.
TEST(MessagePool, WhatIsBeingReadStaysReadableWhileThePoolGrows) {
  MessagePool pool;
  const auto message = [](std::uint64_t value) {
    return Message{{{1, 0}, LpId{1}, 0, 0}, LpId{0}, 1, false, Payload::of(value)};
  };
  const std::uint32_t place = pool.put(message(0x1234567890abcdef));
  const std::span<const std::byte> read = pool[place].payload.bytes();
  std::vector<Bytes> others;  // that take what the pool would have given back
  for (std::uint64_t i = 0; i < 10'000; ++i) {
    ASSERT_EQ(pool[pool.put(message(i))].payload, Payload::of(i));
    if (std::has_single_bit(i))
      for (std::size_t size = 24; size < 1024; size += 16) others.emplace_back(size, std::byte{7});
    ASSERT_EQ(Payload(read), Payload::of(std::uint64_t{0x1234567890abcdef})) << i;
  }
  EXPECT_EQ(pool[place].payload, Payload(read));
}

TEST(MessageCalendar, TakesTheEarliestAndAmongEqualsTheLowestDestination) {
  for (const std::int64_t spread : {3, 400, 1'000'000}) {
    SplitMix64 random(4);
    MessagePool pool;
    MessageCalendar calendar(pool);
    std::multiset<std::pair<VirtualTime, std::uint32_t>> plain;
    std::int64_t now = 0;
    for (int change = 0; change < 40000; ++change) {
      // Fills up, empties, fills up.
      const bool fills = change / 8000 % 2 == 0;
      if (plain.empty() || random.below(10) < (fills ? 7u : 3u)) {
        const VirtualTime time{now + static_cast<std::int64_t>(random.below(spread)),
                               static_cast<std::uint32_t>(random.below(2))};
        const auto lp = static_cast<std::uint32_t>(random.below(50));
        calendar.push(pool.emplace(OutputId{time, LpId{lp}, 0, 0}, LpId{1}, 1u, false, Payload()));
        plain.insert({time, lp});
      } else {
        ASSERT_EQ(calendar.top_time(), plain.begin()->first);
        ASSERT_EQ(index_of(calendar.top_lp()), plain.begin()->second);
        now = plain.begin()->first.t;
        const std::uint32_t place = calendar.pop();
        ASSERT_EQ(pool[place].time, plain.begin()->first);
        ASSERT_EQ(index_of(pool[place].destination), plain.begin()->second);
        pool.release(place);
        plain.erase(plain.begin());
      }
      ASSERT_EQ(calendar.size(), plain.size());
    }
  }
}

// As many as lie in order, far more, and all that is between.
TEST(ShortHeap, GivesTheLeastOfAny) {
  SplitMix64 random(8);
  ShortHeap<int> heap;
  std::multiset<int> plain;
  for (const std::size_t about : {4, 16, 20, 300, 0}) {
    for (int change = 0; change < 20000; ++change) {
      const bool grows = plain.size() < about ? random.below(4) > 0 : random.below(4) == 0;
      if (plain.empty() || grows) {
        const int value = static_cast<int>(random.below(1000));
        heap.push(value);
        plain.insert(value);
      } else {
        heap.pop();
        plain.erase(plain.begin());
      }
      ASSERT_EQ(heap.size(), plain.size());
      if (plain.empty()) continue;
      ASSERT_EQ(heap.top(), *plain.begin());
    }
    std::vector<int> all;
    heap.append_to(all);
    std::sort(all.begin(), all.end());
    ASSERT_TRUE(std::equal(all.begin(), all.end(), plain.begin(), plain.end()));
  }
}

TEST(SlotTable, CountsWhatIsInUsePerMessageId) {
  SplitMix64 random(5);
  SlotTable table;
  std::map<std::tuple<VirtualTime, LpId, std::uint32_t>, std::uint32_t> plain;
  std::vector<OutputId> taken;
  std::int64_t now = 0;
  for (int change = 0; change < 50000; ++change) {
    if (taken.empty() || random.below(3) > 0) {
      OutputId id{{now + 1 + static_cast<std::int64_t>(random.below(20)), 0},
                  LpId{static_cast<std::uint32_t>(random.below(3))},
                  static_cast<std::uint32_t>(random.below(2)),
                  0};
      id.slot = table.take(id, {now, 0});
      ASSERT_EQ(id.slot, (plain[{id.time, id.destination, id.kind}]++));
      taken.push_back(id);
    } else {
      const OutputId id = taken.back();
      taken.pop_back();
      ASSERT_EQ(table.release({now, 0}), id);
      if (random.below(3) == 0) {  // put back in force
        table.take_again(id, {now, 0});
        taken.push_back(id);
        continue;
      }
      ASSERT_EQ(id.slot, (--plain[{id.time, id.destination, id.kind}]));
    }
    if (random.below(50) == 0) {
      ++now;
      // What was sent before that can no longer be undone.
      while (std::any_of(taken.begin(), taken.end(),
                         [&](const OutputId& id) { return id.time.t <= now; }))
        taken.erase(taken.begin());
    }
  }
  EXPECT_GT(now, 500);
}

// As many as an index is kept for: taken, given back and forgotten, a step costs the same however
// many there are.
TEST(SlotTable, CountsWhatIsInUseAmongVeryMany) {
  SplitMix64 random(7);
  SlotTable table;
  std::map<std::pair<std::int64_t, std::uint32_t>, std::uint32_t> plain;
  std::vector<OutputId> undoable;
  std::int64_t now = 0;
  for (int change = 0; change < 300'000; ++change) {
    if (change % 1000 == 999) {  // all that was sent so far is irrevocable
      undoable.clear();
      now += change < 150'000 ? 1 : 90;
      plain.erase(plain.begin(), plain.lower_bound({now + 1, 0}));
    }
    if (undoable.empty() || random.below(4) > 0) {
      OutputId id{{now + 1 + static_cast<std::int64_t>(random.below(20'000)), 0},
                  LpId{static_cast<std::uint32_t>(random.below(4))},
                  0,
                  0};
      id.slot = table.take(id, {now, 0});
      ASSERT_EQ(id.slot, (plain[{id.time.t, index_of(id.destination)}]++));
      undoable.push_back(id);
    } else {
      const OutputId id = undoable.back();
      undoable.pop_back();
      ASSERT_EQ(table.release({now, 0}), id);
      ASSERT_EQ(id.slot, (--plain[{id.time.t, index_of(id.destination)}]));
    }
  }
  EXPECT_GT(now, 10'000);
}

TEST(SlotTableDeathTest, OnlyTheNextFreeSlotIsTakenAgain) {
  SlotTable table;
  const OutputId first{{5, 0}, LpId{1}, 0, 0};
  table.take(first, kBeginning);
  table.take(first, kBeginning);
  EXPECT_DEATH(table.take_again(first, kBeginning),
               "slot 0 at \\(5, 0\\) to LP 1 is taken again, free is 2");
  EXPECT_DEATH(table.release({5, 0}), "of 2 taken, all up to \\(5, 0\\) forgotten");
}

TEST(CopyHistory, RestoresWhatWasSavedBeforeTheFirstUndoneTimeAndSavesItAnew) {
  CopyHistory<int> history;
  int state = 0;
  history.mark({1, 0}, state);
  history.mark({3, 0}, state = 1);
  history.mark({7, 0}, state = 2);
  EXPECT_EQ(history.rewind_before({7, 0}, {5, 0}, state), (VirtualTime{5, 0}));
  EXPECT_EQ(state, 2) << "nothing was executed between 3 and 7";
  EXPECT_EQ(history.rewind_before({5, 0}, {4, 0}, state), (VirtualTime{4, 0}));
  EXPECT_EQ(state, 2);
  EXPECT_EQ(history.rewind({4, 0}, state), (VirtualTime{4, 0}));
  EXPECT_EQ(history.rewind_before({3, 0}, {3, 0}, state), (VirtualTime{3, 0}));
  EXPECT_EQ(state, 1);
  EXPECT_EQ(history.size(), 2u);
}

TEST(StandardPhold, LogarithmIsExactEnoughForTicks) {
  SplitMix64 random(8);
  constexpr std::uint64_t kOne = std::uint64_t{1} << 53;
  EXPECT_EQ(minus_log_of_fraction(kOne), 0.0);
  for (int i = 0; i < 100000; ++i) {
    const std::uint64_t x = 1 + (random.next() >> (11 + random.below(53)));
    const double exact = -std::log(static_cast<double>(x) / static_cast<double>(kOne));
    ASSERT_NEAR(minus_log_of_fraction(x), exact, 1e-10) << x;
  }
}

}  // namespace
}  // namespace soda::kernel
