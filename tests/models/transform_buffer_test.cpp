#include "models/transform_buffer/transform_buffer.hpp"

#include <gtest/gtest.h>

#include <map>

#include "physics/measures/measures.hpp"
#include "tests/support/scenes.hpp"

namespace soda::models {
namespace {

using physics::BodyId;
using physics::BodyState;
using physics::Vec3;

BufferEntry entry_of(std::int64_t step) {
  BufferEntry entry;
  entry.step = step;
  return entry;
}

// Every third id, as a world has that shares space with others; each body with `impulses`.
BufferEntry bodies_of(std::uint32_t count, std::uint32_t impulses) {
  BufferEntry entry = entry_of(0);
  for (std::uint32_t body = 0; body < count; ++body) {
    entry.ids.push_back(BodyId{3 * body});
    entry.states.emplace_back();
    entry.states.back().position_m = Vec3(body, -0.0, 1);
    entry.states.back().impulses.resize(impulses);
  }
  return entry;
}

// A step of a world that may go back: takes the bodies of the newest entry, writes the next.
template <class Advance>
void step(TransformBuffer& buffer, WorldCounters& counters, Advance advance) {
  BufferEntry work;
  buffer.copy_bodies(buffer.newest(), work.ids, work.states, counters);
  advance(work);
  BufferEntry& next = buffer.append();
  next.ids = work.ids;
  next.states = work.states;
}

void rest(BufferEntry&) {}

void move_all(BufferEntry& work) {
  for (BodyState& state : work.states) state.position_m.z() += 0.1;
}

TEST(TransformBuffer, HoldsConsecutiveEntriesUpToItsCapacity) {
  TransformBuffer buffer(4, bodies_of(5, 0));
  WorldCounters counters;
  for (int i = 1; i <= 3; ++i) step(buffer, counters, move_all);
  EXPECT_EQ(buffer.oldest(), 0);
  EXPECT_EQ(buffer.newest(), 3);
  for (std::int64_t at = 0; at <= 3; ++at) {
    BufferEntry copy;
    EXPECT_EQ(buffer.read(at, true, copy).step, at);
    EXPECT_NEAR(buffer.read(at, true, copy).states[4].position_m.z(), 1 + 0.1 * at, 1e-12);
  }
}

TEST(TransformBuffer, ReusesSlotsOfForgottenEntries) {
  TransformBuffer buffer(3, bodies_of(2, 0));
  WorldCounters counters;
  for (std::int64_t at = 1; at <= 100; ++at) {
    buffer.forget(at - 1);
    step(buffer, counters, move_all);
    EXPECT_EQ(buffer.newest(), at);
    EXPECT_TRUE(buffer.holds(at - 1));
    EXPECT_FALSE(buffer.holds(at - 2));
  }
}

TEST(TransformBuffer, NeverForgetsTheNewestEntry) {
  TransformBuffer buffer(3, bodies_of(1, 0));
  WorldCounters counters;
  step(buffer, counters, rest);
  buffer.forget(99);
  EXPECT_EQ(buffer.oldest(), 1);
  EXPECT_EQ(buffer.newest(), 1);
}

TEST(TransformBuffer, TruncatingMakesLaterEntriesStale) {
  TransformBuffer buffer(5, entry_of(7));
  WorldCounters counters;
  for (int i = 0; i < 4; ++i) step(buffer, counters, rest);
  EXPECT_EQ(buffer.stale_next(), nullptr);
  buffer.truncate(9, counters);
  EXPECT_EQ(buffer.oldest(), 7);
  EXPECT_EQ(buffer.newest(), 9);
  ASSERT_NE(buffer.stale_next(), nullptr);
  EXPECT_EQ(buffer.stale_next()->step, 10);
  step(buffer, counters, rest);
  EXPECT_EQ(buffer.newest(), 10);
  EXPECT_EQ(buffer.stale_next()->step, 11) << "it was open when it became stale";
}

// Also of numbers that are equal or unordered as numbers, and of ids that come and go.
TEST(TransformBuffer, GivesBackTheBitsThatWereWrittenThroughAnyRollback) {
  test::Choices choices(7);
  TransformBuffer buffer(9, bodies_of(40, 2));
  std::map<std::int64_t, BufferEntry> written = {{0, bodies_of(40, 2)}};
  WorldCounters counters;
  const auto mutate = [&choices](BufferEntry& work) {
    for (BodyState& state : work.states) {
      if (choices.below(4) != 0) continue;
      const double odd[] = {0.0, -0.0, std::nan(""), 1e308, choices.between(-1, 1)};
      state.angular_velocity_rad_s[choices.below(3)] = odd[choices.below(5)];
      state.impulses.resize(choices.below(4));
      state.broken_joints.assign(choices.below(3) * choices.below(8), 7);
      for (physics::ContactImpulse& impulse : state.impulses) {
        impulse.part = 3;
        impulse.normal_newton_s = odd[choices.below(5)];
      }
    }
    const std::size_t place = choices.below(work.ids.size() - 1);
    const auto between = physics::index_of(work.ids[place]) + 1;
    if (choices.below(2) == 0 && physics::index_of(work.ids[place + 1]) > between) {
      work.ids.insert(work.ids.begin() + static_cast<long>(place) + 1, BodyId{between});
      work.states.insert(work.states.begin() + static_cast<long>(place), work.states[place]);
    } else if (work.ids.size() > 20) {
      work.ids.erase(work.ids.begin() + static_cast<long>(place));
      work.states.erase(work.states.begin() + static_cast<long>(place));
    }
  };
  for (int round = 0; round < 3000; ++round) {
    const std::int64_t span = buffer.newest() - buffer.oldest();
    if (span == 8 || choices.below(8) == 0)
      buffer.forget(buffer.oldest() + 1 + static_cast<std::int64_t>(choices.below(2)));
    if (choices.below(5) == 0)
      buffer.truncate(buffer.oldest() + static_cast<std::int64_t>(
                                            choices.below(buffer.newest() - buffer.oldest() + 1)),
                      counters);
    step(buffer, counters, [&](BufferEntry& work) {
      mutate(work);
      written[buffer.newest() + 1] = work;
    });
    BufferEntry copy;
    for (std::int64_t at = buffer.oldest(); at <= buffer.newest(); ++at) {
      const BufferEntry& read = buffer.read(at, true, copy);
      ASSERT_EQ(read.ids, written[at].ids);
      for (std::size_t i = 0; i < read.ids.size(); ++i)
        ASSERT_TRUE(identical(read.states[i], written[at].states[i])) << round << " " << at;
    }
  }
}

// Bytes that `steps` entries took, over what one entry's states take whole.
template <class Advance>
double share_taken(std::uint32_t bodies, std::uint32_t impulses, Advance advance) {
  TransformBuffer buffer(9, bodies_of(bodies, impulses));
  WorldCounters counters;
  step(buffer, counters, advance);  // entry 0 has nothing to share with
  counters = {};
  for (std::int64_t at = 2; at <= 41; ++at) {
    buffer.forget(at - 8);
    step(buffer, counters, advance);
  }
  EXPECT_EQ(counters.entries_stored, 40u);
  return static_cast<double>(counters.state_bytes_stored) /
         static_cast<double>(counters.state_bytes_whole);
}

TEST(EntrySharing, AMovingBodyTakesAtMostFiveQuartersOfItsState) {
  for (const std::uint32_t impulses : {0u, 1u, 4u, 9u})
    EXPECT_LE(share_taken(100, impulses, move_all), 1.25) << impulses;
}

TEST(EntrySharing, AWorldAtRestTakesAtMostATwentiethOfThat) {
  for (const std::uint32_t impulses : {0u, 4u})
    EXPECT_LE(share_taken(100, impulses, rest), 0.05 * 1.25) << impulses;
}

TEST(EntrySharing, RestingBodiesBesideAMovingOneTakeAlmostNothing) {
  const auto move_one = [](BufferEntry& work) { work.states[500].position_m.z() += 0.1; };
  EXPECT_LE(share_taken(1000, 4, move_one), 0.02);
}

TEST(EntrySharing, ABodyThatComesLeavesTheOthersShared) {
  const auto admit_one = [next = 1u](BufferEntry& work) mutable {
    const auto place = std::lower_bound(work.ids.begin(), work.ids.end(), BodyId{next});
    work.states.insert(work.states.begin() + (place - work.ids.begin()), BodyState());
    work.ids.insert(place, BodyId{next});
    next += 3;
  };
  EXPECT_LE(share_taken(1000, 4, admit_one), 0.02);
}

TEST(EntrySharing, AnEntryThatComesOutAgainIsTakenFromItsStaleVersion) {
  TransformBuffer buffer(5, bodies_of(100, 1));
  WorldCounters counters;
  for (int i = 0; i < 4; ++i) step(buffer, counters, move_all);
  buffer.truncate(0, counters);
  const std::uint64_t taken = buffer.memory().taken_bytes;
  for (int i = 0; i < 4; ++i) step(buffer, counters, move_all);
  buffer.truncate(3, counters);  // so that the last is stored, too
  // Lists anew, states not: 16 bytes of 192, and the chunks.
  EXPECT_LE(buffer.memory().taken_bytes - taken, 4u * 100u * 40u);
}

TEST(EntrySharing, ALongRunWithRollbacksHoldsNoMoreMemoryThanAShortOne) {
  TransformBuffer buffer(9, bodies_of(60, 2));
  WorldCounters counters;
  test::Choices choices(3);
  const auto most_of = [&](int steps) {
    std::uint64_t most = 0;
    for (int i = 0; i < steps; ++i) {
      buffer.forget(buffer.newest() - 7);
      if (choices.below(4) == 0 && buffer.newest() > buffer.oldest())
        buffer.truncate(buffer.newest() - 1, counters);
      // Some rest for hundreds of steps while others move: none may keep the memory of many.
      step(buffer, counters, [&](BufferEntry& work) {
        for (std::size_t body = 0; body < work.states.size(); ++body)
          if (body % 2 == 0 || choices.below(300) == 0) work.states[body].position_m.x() += 0.01;
      });
      most = std::max(most, buffer.memory().live_bytes);
    }
    return most;
  };
  const std::uint64_t early = most_of(200), late = most_of(20000);
  EXPECT_LE(late, early + early / 10);
  EXPECT_GT(early, 0u);
}

TEST(TransformBufferDeathTest, OverfillingOrReadingWhatIsNotHeldAborts) {
  TransformBuffer buffer(2, entry_of(0));
  WorldCounters counters;
  BufferEntry copy;
  step(buffer, counters, rest);
  EXPECT_DEATH(buffer.append(), "is full");
  EXPECT_DEATH(buffer.read(2, true, copy), "not held");
  EXPECT_DEATH(buffer.truncate(5, counters), "not held");
}

}  // namespace
}  // namespace soda::models
