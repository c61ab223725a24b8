#include "models/islands/solve_share.hpp"

#include <gtest/gtest.h>

namespace soda::models {
namespace {

kernel::Bytes bytes_of(int value) { return kernel::Bytes(8, static_cast<std::byte>(value)); }

TEST(SolveShare, FindsExactlyWhatWasStored) {
  SolveShare share(2);
  const auto solved = std::make_shared<const SolvedIsland>();
  share.store(5, bytes_of(1), solved);
  EXPECT_EQ(share.find(bytes_of(1)), solved);
  EXPECT_EQ(share.find(bytes_of(2)), nullptr);
}

TEST(SolveShare, DropsSolvesBeyondTheStepsItKeeps) {
  SolveShare share(2);
  for (int step = 0; step < 10; ++step) {
    share.store(step, bytes_of(step), std::make_shared<const SolvedIsland>());
  }
  EXPECT_EQ(share.find(bytes_of(6)), nullptr);
  EXPECT_NE(share.find(bytes_of(7)), nullptr);
  EXPECT_NE(share.find(bytes_of(9)), nullptr);
}

}  // namespace
}  // namespace soda::models
