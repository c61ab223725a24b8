// What a run costs beyond its physics: instructions of an undivided run, memory of a long one.
#include <gtest/gtest.h>

#include <sstream>

#include "analysis/child_process.hpp"

namespace soda::analysis {
namespace {

using analysis_test::ChildResult;
using analysis_test::library_file;
using analysis_test::run_child;
using analysis_test::run_soda;
using analysis_test::TemporaryFolder;

struct CountedRun {
  std::uint64_t instructions = 0;
  std::string digest;
};

// The word after `key` in `text`.
std::string word_after(const std::string& text, const std::string& key) {
  const std::size_t at = text.find(key);
  if (at == std::string::npos) return {};
  std::istringstream rest(text.substr(at + key.size()));
  std::string word;
  rest >> word;
  return word;
}

CountedRun count_instructions(const std::vector<std::string>& program, const std::string& key) {
  const TemporaryFolder folder;
  std::vector<std::string> argv = {"/usr/bin/valgrind", "--tool=callgrind",
                                   "--callgrind-out-file=" + folder.file("callgrind.out")};
  argv.insert(argv.end(), program.begin(), program.end());
  const ChildResult result = run_child(argv);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const std::string collected = word_after(result.err, "Collected :");
  return {collected.empty() ? 0 : std::stoull(collected), word_after(result.out, key)};
}

// Whole processes are compared, with reading, geometry, measures and reporting on both sides.
void expect_one_world_to_cost_its_physics(const std::string& scene) {
  const std::string file = library_file(scene);
  const CountedRun loop =
      count_instructions({SODA_BINARY_DIR "/physics_loop", file, "20"}, "digest ");
  const CountedRun run =
      count_instructions({SODA_BINARY_DIR "/soda", "run", file, "--executor", "sequential",
                          "--worlds", "1", "--steps", "20", "--quiet"},
                         "digest of the state after the last step ");
  ASSERT_GT(loop.instructions, 0u);
  EXPECT_EQ(run.digest, loop.digest);
  const double ratio =
      static_cast<double>(run.instructions) / static_cast<double>(loop.instructions);
  std::cout << scene << ": " << run.instructions << " instructions over " << loop.instructions
            << " = " << ratio << "\n";
  EXPECT_LE(ratio, 1.03);
}

TEST(RunCost, OneWorldCostsThePhysicsLoopForBin1000) {
  expect_one_world_to_cost_its_physics("bin-1000");
}

TEST(RunCost, OneWorldCostsThePhysicsLoopForSparse10000) {
  expect_one_world_to_cost_its_physics("sparse-10000");
}

// Of what it holds: options and digests, all states, the life of every event.
TEST(RunCost, ALogCostsAtMostThreePercent) {
  const TemporaryFolder folder;
  const auto run_with = [](const std::vector<std::string>& options) {
    std::vector<std::string> command = {SODA_BINARY_DIR "/soda",
                                        "run",
                                        library_file("bin-1000"),
                                        "--executor",
                                        "sequential",
                                        "--worlds",
                                        "1",
                                        "--steps",
                                        "100",
                                        "--quiet"};
    command.insert(command.end(), options.begin(), options.end());
    return count_instructions(command, "digest of the state after the last step ");
  };
  const CountedRun without = run_with({});
  ASSERT_GT(without.instructions, 0u);
  const struct {
    const char* level;
    double most;
  } levels[] = {{"inputs", 1.01}, {"commits", 1.03}, {"trace", 1.03}};
  for (const auto& [level, most] : levels) {
    const CountedRun with = run_with({"--log", folder.file(level), "--log-level", level});
    EXPECT_EQ(with.digest, without.digest);
    const double ratio =
        static_cast<double>(with.instructions) / static_cast<double>(without.instructions);
    std::cout << level << ": " << ratio << "\n";
    EXPECT_GT(ratio, 1.0);
    EXPECT_LE(ratio, most) << level;
  }
}

// One body of ten thousand is pushed: what is far from it is neither computed nor read.
TEST(RunCost, ABranchCostsWhatItsConeCosts) {
  const TemporaryFolder folder;
  const std::string log = folder.file("run.sodalog"), inputs = folder.file("push.jsonl");
  const std::string soda = SODA_BINARY_DIR "/soda", scene = library_file("sparse-10000");
  const auto count = [](const std::vector<std::string>& command, const std::string& key) {
    return count_instructions(command, key);
  };
  ASSERT_EQ(run_soda({"run", scene, "--quiet", "--log", log}).exit_code, 0);
  analysis_test::write_file(inputs, R"({"id": 9001, "type": "push", "step": 30, "body": 7, )"
                                    R"("impulse_newton_s": [400, 0, 0]})"
                                    "\n");
  const CountedRun whole =
      count({soda, "run", scene, "--inputs", inputs, "--executor", "sequential", "--quiet"},
            "digest of the state after the last step ");
  const CountedRun branch =
      count({soda, "branch", log, "--step", "30", "--inputs", inputs, "--quiet"},
            "new inputs: 1, digest ");
  const CountedRun nothing = count({soda, "--version"}, "soda ");
  EXPECT_EQ(branch.digest, whole.digest);
  const auto share = [&](std::uint64_t instructions) {
    return static_cast<double>(instructions) / static_cast<double>(whole.instructions);
  };
  std::cout << "branch: " << share(branch.instructions) << " of a whole run, of which "
            << share(nothing.instructions) << " for the start of the program\n";
  EXPECT_LE(share(branch.instructions), 0.05);
}

// A gas is in its steady state from the start: contacts that appear later cost memory too, and that
// is no growth with the number of steps. 5 % are 85 bytes a step here.
TEST(RunCost, MemoryDoesNotGrowWithTheNumberOfSteps) {
  const auto peak_rss_kib = [](const char* steps) {
    const ChildResult result =
        run_soda({"run", library_file("spheres-frictionless"), "--worlds", "4", "--threads", "2",
                  "--buffer", "8", "--steps", steps, "--quiet"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return static_cast<double>(result.peak_rss_kib);
  };
  const double short_run = peak_rss_kib("1000");
  const double long_run = peak_rss_kib("10000");
  std::cout << "peak memory " << short_run << " KiB after 1000 steps, " << long_run
            << " KiB after 10000\n";
  EXPECT_LE(long_run, 1.05 * short_run);
}

}  // namespace
}  // namespace soda::analysis
