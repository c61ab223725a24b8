// A log needs nothing beside it: its run again, with its own options and files. Through the binary.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "analysis/child_process.hpp"
#include "analysis/event_log/log_reader.hpp"
#include "analysis/forged_log.hpp"
#include "analysis/text/exit_codes.hpp"

namespace soda::analysis {
namespace {

using analysis_test::ChildResult;
using analysis_test::contains;
using analysis_test::forge_log;
using analysis_test::ForgedBlock;
using analysis_test::library_file;
using analysis_test::overwrite;
using analysis_test::run_soda;
using analysis_test::TemporaryFolder;
using nlohmann::json;

json parsed(const ChildResult& result) {
  EXPECT_EQ(result.exit_code, kExitOk) << result.err;
  return json::parse(result.out);
}

// Of border-stack on a slow virtual cluster without dependency waits: thousands of rollbacks.
json run_of_border_stack(const std::string& log) {
  return parsed(
      run_soda({"run", library_file("border-stack"), "--gating", "off", "--latency-us", "60",
                "--jitter-us", "30", "--execution-seed", "7", "--json", "--log", log}));
}

TEST(ReplayOptions, AVirtualRunIsExecutedAgainEventForEvent) {
  const TemporaryFolder folder;
  const std::string log = folder.file("a.sodalog");
  const json logged = run_of_border_stack(log);
  ASSERT_GT(logged["events"]["rolled_back"], 1000);
  const json again = parsed(run_soda({"replay", log, "--json"}));
  EXPECT_TRUE(again["divergence"].is_null());
  for (const char* key : {"events", "virtual", "digest", "gating", "worlds", "stages"})
    EXPECT_EQ(again[key], logged[key]) << key;
}

TEST(ReplayOptions, AnotherOptionOfTheSameRunChangesTheExecutionAndNotTheDigest) {
  const TemporaryFolder folder;
  const std::string log = folder.file("a.sodalog");
  const json logged = run_of_border_stack(log);
  const json gated = parsed(run_soda({"replay", log, "--gating", "on", "--json"}));
  EXPECT_LT(gated["events"]["rolled_back"], logged["events"]["rolled_back"]);
  EXPECT_EQ(gated["digest"], logged["digest"]);
  for (const std::vector<std::string>& more : {std::vector<std::string>{"--threads", "2"},
                                               {"--executor", "sequential"},
                                               {"--policy", "lockstep"},
                                               {"--latency-us", "5"},
                                               {"--worlds", "2", "--buffer", "3"}}) {
    std::vector<std::string> command = {"replay", log};
    command.insert(command.end(), more.begin(), more.end());
    const ChildResult result = run_soda(command);
    EXPECT_EQ(result.exit_code, kExitOk) << more[0] << " " << more[1] << ": " << result.err;
    EXPECT_TRUE(contains(result.out, "300 steps replayed without divergence")) << result.out;
  }
}

TEST(ReplayOptions, AnExecutionThatWasAnotherIsADivergence) {
  const TemporaryFolder folder;
  const std::string log = folder.file("a.sodalog"), forged = folder.file("b.sodalog");
  run_of_border_stack(log);
  forge_log(log, forged, [](ForgedBlock& block) {
    if (block.type == BlockType::kEnd) overwrite(block.payload, 17, std::uint64_t{1});
  });
  const ChildResult told = run_soda({"replay", forged});
  EXPECT_EQ(told.exit_code, kExitCheckFailed);
  EXPECT_TRUE(contains(told.err, "logged 0000000000000001")) << told.err;
  // With other options it is not to be the same.
  EXPECT_EQ(run_soda({"replay", forged, "--gating", "on"}).exit_code, kExitOk);
}

TEST(ReplayOptions, MeshFilesAreInTheLog) {
  const TemporaryFolder folder;
  const std::string scene = folder.file("scene.json"), log = folder.file("a.sodalog");
  std::filesystem::copy(library_file("mixed-shapes"), scene);
  const auto library = std::filesystem::path(library_file("mixed-shapes")).parent_path();
  const std::vector<std::string> files = {"ramp.stl", "terrain.obj"};
  for (const std::string& file : files) std::filesystem::copy(library / file, folder.file(file));
  ASSERT_EQ(run_soda({"run", scene, "--steps", "20", "--log", log}).exit_code, kExitOk);
  for (const std::string& file : files) std::filesystem::remove(folder.file(file));
  std::filesystem::remove(scene);
  const ChildResult again = run_soda({"replay", log});
  EXPECT_EQ(again.exit_code, kExitOk) << again.err;
  EXPECT_EQ(run_soda({"view", log}).exit_code, kExitOk);
  EXPECT_EQ(run_soda({"contacts", log}).exit_code, kExitOk);
}

TEST(ReplayOptions, AMeshThatTheLogLacksIsAFaultOfItsScenario) {
  const TemporaryFolder folder;
  const std::string log = folder.file("a.sodalog"), forged = folder.file("b.sodalog");
  ASSERT_EQ(run_soda({"run", library_file("mixed-shapes"), "--steps", "2", "--log", log}).exit_code,
            kExitOk);
  forge_log(log, forged, [](ForgedBlock& block) {
    if (block.type == BlockType::kMesh) overwrite(block.payload, 8, std::uint8_t{'X'});
  });
  const ChildResult told = run_soda({"replay", forged});
  EXPECT_EQ(told.exit_code, kExitInput);
  EXPECT_TRUE(contains(told.err, "is not among the files that are kept")) << told.err;
}

}  // namespace
}  // namespace soda::analysis
