// `soda fuzz --whole` and `--continuity` through the binary: what a wrong program is told.
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <thread>

#include "analysis/child_process.hpp"
#include "analysis/text/exit_codes.hpp"

namespace soda::analysis {
namespace {

using analysis_test::ChildResult;
using analysis_test::contains;
using analysis_test::run_soda;
using analysis_test::TemporaryFolder;
using Json = nlohmann::json;

// A program in soda's place: what it does when it is to run a scenario. $real is soda.
std::string impostor(const TemporaryFolder& folder, const std::string& run) {
  const std::string file = folder.file("impostor");
  analysis_test::write_file(file, "#!/bin/sh\nreal=" SODA_BINARY_DIR
                                  "/soda\n[ \"$1\" = run ] || exec $real \"$@\"\n" +
                                      run + "\n");
  std::filesystem::permissions(file, std::filesystem::perms::owner_all);
  return file;
}

Json failure_of(const std::string& run) {
  const TemporaryFolder folder;
  const ChildResult result =
      run_soda({"fuzz", "--whole", "--seeds", "1..1", "--executors", "sequential", "--shrinking",
                "0", "--program", impostor(folder, run), "--json"});
  EXPECT_EQ(result.exit_code, 1) << result.out << result.err;
  const Json json = Json::parse(result.out);
  return json["failures"].empty() ? Json::object() : json["failures"][0];
}

TEST(WholeFuzz, ADigestThatIsNotThePlainLoopsIsADivergence) {
  const Json failure = failure_of(
      "$real \"$@\" | sed '/step_digests/,$ s/\"[0-9a-f]\\{16\\}\"/"
      "\"0123456789abcdef\"/'");
  EXPECT_EQ(failure["kind"], "divergence") << failure;
  EXPECT_TRUE(contains(failure["what"], "step 1 has digest 0123456789abcdef")) << failure;
}

TEST(WholeFuzz, AWrongExitCodeACrashAndASanitizersWordsAreTold) {
  EXPECT_EQ(failure_of("$real \"$@\"; exit 1")["kind"], "exit code");
  EXPECT_EQ(failure_of("kill -SEGV $$")["kind"], "crash");
  EXPECT_EQ(failure_of("echo 'ERROR: AddressSanitizer: heap-use-after-free' >&2")["kind"],
            "sanitizer");
}

// The limit is lowered, as that of the search is hundreds of times what the plain loop takes.
TEST(WholeFuzz, WhatUsesUpItsProcessorTimeIsToldAsAHang) {
  EXPECT_EQ(failure_of("ulimit -S -t 1; while :; do :; done")["kind"], "hang");
}

TEST(WholeFuzz, ASeedsRunsAreThePlainLoops) {
  const ChildResult result = run_soda({"fuzz", "--whole", "--seeds", "3..6", "--executors",
                                       "default,sequential,virtual", "--json"});
  const Json json = Json::parse(result.out);
  EXPECT_EQ(json["trials"], 4);
  EXPECT_GT(json["steps"], 0);
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
}

// The program under test holds still, so that the signal finds the search at a seed.
TEST(WholeFuzz, WhatIsKnownIsToldWhenASignalEndsTheSearch) {
  const TemporaryFolder folder;
  const std::string begun = folder.file("begun");
  const ChildResult result = run_soda(
      {"fuzz", "--whole", "--seeds", "1..1000000", "--executors", "sequential", "--program",
       impostor(folder, "touch " + begun + "; sleep 0.5; exec $real \"$@\""), "--json"},
      {[] { alarm(100); },
       [&](int child) {
         while (!std::filesystem::exists(begun))
           std::this_thread::sleep_for(std::chrono::milliseconds(10));
         kill(child, SIGINT);
       }});
  EXPECT_EQ(result.exit_code, kExitSignal + SIGINT) << result.out << result.err;
  const Json json = Json::parse(result.out);
  EXPECT_EQ(json["ended_early"], "SIGINT");
  EXPECT_EQ(json["trials"], 1);
  EXPECT_TRUE(json["failures"].empty()) << json;
}

TEST(ContinuityFuzz, WhatIsFarAwayOrUnusedChangesNoBit) {
  const ChildResult result = run_soda(
      {"fuzz", "--continuity", "--seeds", "1..3", "--kinds", "far-body,unused-material", "--json"});
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  const Json json = Json::parse(result.out);
  EXPECT_EQ(json["changes"]["far-body"]["same_bits"], json["changes"]["far-body"]["scenes"]);
  EXPECT_GT(json["changes"]["far-body"]["scenes"], 0);
}

TEST(WholeFuzz, WhatCannotBeAskedForExitsWith2) {
  EXPECT_EQ(run_soda({"fuzz", "--whole", "file.json"}).exit_code, 2);
  EXPECT_EQ(run_soda({"fuzz", "--whole", "--executors", "none"}).exit_code, 2);
  EXPECT_EQ(run_soda({"fuzz", "--whole", "--program", "/no/such/soda"}).exit_code, 2);
  EXPECT_EQ(run_soda({"fuzz", "--continuity", "--kinds", "none"}).exit_code, 2);
}

}  // namespace
}  // namespace soda::analysis
