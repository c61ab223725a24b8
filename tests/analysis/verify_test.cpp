// `soda verify` as a user runs it: which schedules it tries, and what it says about them.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "analysis/child_process.hpp"

namespace soda::analysis_test {
namespace {

ChildResult verify(const std::vector<std::string>& more) {
  std::vector<std::string> arguments = {
      "verify", library_file("border-stack"), "--steps", "4", "--worlds", "12", "--buffers", "8"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return run_soda(arguments);
}

TEST(Verify, TriesTheScheduleOfUsersToo) {
  const ChildResult found = verify({"--threads", "1", "--seeds", "1", "--json"});
  EXPECT_EQ(found.exit_code, 0) << found.err;
  std::size_t seed_0 = 0;
  for (std::size_t at = 0; (at = found.out.find("\"scheduling_seed\": 0", at)) != std::string::npos;
       ++at)
    ++seed_0;
  EXPECT_EQ(seed_0, 2u) << "the sequential run and one on threads";
  EXPECT_TRUE(contains(found.out, "\"scheduling_seed\": 1"));
  EXPECT_TRUE(contains(found.out, "\"timed_rounds\": ")) << found.out;
}

TEST(Verify, SaysWhichPathsOfTheKernelWereTakenAndWhichNot) {
  const ChildResult one = verify({"--threads", "1", "--seeds", "0"});
  EXPECT_EQ(one.exit_code, 0) << one.err;
  EXPECT_TRUE(contains(one.out, "paths of the kernel: alone ")) << one.out;
  const std::string others = one.out.substr(std::min(one.out.find("not taken: "), one.out.size()));
  EXPECT_TRUE(contains(others, "shuffled")) << one.out;
  EXPECT_TRUE(contains(others, "to_ranks")) << one.out;
  const ChildResult drawn = verify({"--threads", "2", "--seeds", "3"});
  EXPECT_TRUE(contains(drawn.out, "shuffled ")) << drawn.out;
  EXPECT_TRUE(contains(drawn.out, "coasted ")) << drawn.out;
}

}  // namespace
}  // namespace soda::analysis_test
