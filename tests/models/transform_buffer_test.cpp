#include "models/transform_buffer.hpp"

#include <gtest/gtest.h>

namespace soda::models {
namespace {

BufferEntry entry_of(std::int64_t step) {
  BufferEntry entry;
  entry.step = step;
  return entry;
}

TEST(TransformBuffer, HoldsConsecutiveEntriesUpToItsCapacity) {
  TransformBuffer buffer(4, entry_of(0));
  for (std::int64_t step = 1; step <= 3; ++step) EXPECT_EQ(buffer.append().step, step);
  EXPECT_EQ(buffer.oldest(), 0);
  EXPECT_EQ(buffer.newest(), 3);
  for (std::int64_t step = 0; step <= 3; ++step) EXPECT_EQ(buffer.at(step).step, step);
}

TEST(TransformBuffer, ReusesSlotsOfForgottenEntries) {
  TransformBuffer buffer(3, entry_of(0));
  for (std::int64_t step = 1; step <= 100; ++step) {
    buffer.forget(step - 1);
    buffer.append();
    EXPECT_EQ(buffer.at(step).step, step);
    EXPECT_EQ(buffer.at(step - 1).step, step - 1);
    EXPECT_FALSE(buffer.holds(step - 2));
  }
}

TEST(TransformBuffer, NeverForgetsTheNewestEntry) {
  TransformBuffer buffer(3, entry_of(0));
  buffer.append();
  buffer.forget(99);
  EXPECT_EQ(buffer.oldest(), 1);
  EXPECT_EQ(buffer.newest(), 1);
}

TEST(TransformBuffer, TruncatingDropsLaterEntriesOnly) {
  TransformBuffer buffer(5, entry_of(7));
  for (int i = 0; i < 4; ++i) buffer.append();
  buffer.truncate(9);
  EXPECT_EQ(buffer.oldest(), 7);
  EXPECT_EQ(buffer.newest(), 9);
  EXPECT_EQ(buffer.append().step, 10);
}

TEST(TransformBufferDeathTest, OverfillingOrReadingWhatIsNotHeldAborts) {
  TransformBuffer buffer(2, entry_of(0));
  buffer.append();
  EXPECT_DEATH(buffer.append(), "is full");
  EXPECT_DEATH(buffer.at(2), "not held");
  EXPECT_DEATH(buffer.truncate(5), "not held");
}

}  // namespace
}  // namespace soda::models
