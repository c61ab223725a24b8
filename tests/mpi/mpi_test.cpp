// Jobs that mpirun starts: what they print, how they end.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>
#include <tuple>

#include "analysis/child_process.hpp"

namespace soda {
namespace {

using analysis_test::ChildResult;
using analysis_test::library_file;
using analysis_test::run_child;
using analysis_test::run_soda;
using analysis_test::TemporaryFolder;
using Json = nlohmann::json;

class Mpi : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* name : {"OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM",
                             "OMPI_MCA_rmaps_base_oversubscribe", "OMPI_MCA_mpi_yield_when_idle"})
      setenv(name, "1", 1);
    // A rank that may only use one processor waits long for others that use it, too.
    setenv("OMPI_MCA_hwloc_base_binding_policy", "none", 1);
  }
};

ChildResult run_job(int ranks, std::vector<std::string> arguments) {
  std::vector<std::string> argv = {MPIRUN, "-n", std::to_string(ranks), SODA_BINARY_DIR "/soda"};
  argv.insert(argv.end(), arguments.begin(), arguments.end());
  return run_child(argv);
}

// The rest of the first line that begins with `label`.
std::string after(const std::string& label, const std::string& text) {
  const std::size_t at = text.find(label);
  if (at == std::string::npos) return "(no " + label + ")";
  const std::size_t from = at + label.size();
  return text.substr(from, text.find('\n', from) - from);
}

std::size_t count(const std::string& part, const std::string& text) {
  std::size_t found = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1))
    ++found;
  return found;
}

TEST_F(Mpi, PholdHasTheSequentialDigestForAnyNumberOfRanks) {
  const std::vector<std::string> model = {"phold",
                                          "--lps",
                                          "60",
                                          "--start-events",
                                          "2",
                                          "--remote",
                                          "0.6",
                                          "--end",
                                          "60",
                                          "--order-sensitive",
                                          "--zero-delay-rounds",
                                          "2"};
  const std::string digest = after("digest", run_soda(model).out);
  for (const int ranks : {1, 2, 4}) {
    for (const char* threads : {"1", "2"}) {
      std::vector<std::string> job = model;
      for (const char* more : {"--executor", "mpi", "--threads", threads, "--window", "2"})
        job.push_back(more);
      const ChildResult found = run_job(ranks, job);
      EXPECT_EQ(found.exit_code, 0) << found.err;
      EXPECT_EQ(after("digest", found.out), digest) << ranks << " ranks";
    }
  }
}

TEST_F(Mpi, OnlyTheRootReportsAndItReportsAllSteps) {
  const std::vector<std::string> run = {"run", library_file("twelve-worlds"), "--steps", "20",
                                        "--step-digests"};
  const std::string alone = run_soda(run).out;
  std::vector<std::string> job = run;
  for (const char* more : {"--executor", "mpi"}) job.push_back(more);
  const ChildResult found = run_job(3, job);
  EXPECT_EQ(found.exit_code, 0) << found.err;
  EXPECT_EQ(count("digest of the state", found.out), 1u);
  EXPECT_EQ(count("\nstep ", found.out), 20u);
  EXPECT_EQ(found.out.substr(found.out.find("\nstep 1 ")), alone.substr(alone.find("\nstep 1 ")));
}

// Drives are measured from the states of every step, which the root has to gather from all ranks.
TEST_F(Mpi, ErrorMeasuresAreThoseOfOneProcess) {
  for (const char* scene : {"crowd", "twelve-worlds"}) {
    const std::vector<std::string> run = {"run", library_file(scene), "--steps", "15"};
    std::vector<std::string> job = run;
    for (const char* more : {"--executor", "mpi", "--threads", "2"}) job.push_back(more);
    const std::string alone = run_soda(run).out, over = run_job(3, job).out;
    for (const char* error :
         {"energy drift", "momentum drift", "deepest penetration", "constraint residual"}) {
      // Up to the unit: the run time stands beside it.
      const std::string expected = after(error, alone);
      EXPECT_EQ(after(error, over).substr(0, 20), expected.substr(0, 20)) << scene << ": " << error;
    }
  }
}

TEST_F(Mpi, ALogOfAJobIsReplayedWithoutMpi) {
  const TemporaryFolder folder;
  const std::string log = folder.file("run.sodalog");
  const ChildResult job = run_job(
      2, {"run", library_file("third-world"), "--steps", "30", "--executor", "mpi", "--log", log});
  EXPECT_EQ(job.exit_code, 0) << job.err;
  const ChildResult replay = run_soda({"replay", log});
  EXPECT_EQ(replay.exit_code, 0) << replay.err;
}

// Of more ranks than worlds, too: those without one tell of GVT only.
TEST_F(Mpi, ATracedJobIsExplainedAndHadAgainAsItWasExecuted) {
  const TemporaryFolder folder;
  const std::string log = folder.file("run.sodalog");
  for (const auto& [scene, worlds, balancing] :
       {std::tuple("third-world", "2", "off"), std::tuple("third-world", "4", "off"),
        std::tuple("user-input", "4", "random")}) {
    const ChildResult job = run_job(
        4, {"run", library_file(scene), "--steps", "60", "--worlds", worlds, "--balancing",
            balancing, "--executor", "mpi", "--log", log, "--log-level", "trace", "--force"});
    EXPECT_EQ(job.exit_code, 0) << job.err;
    const ChildResult why = run_soda({"why", log});
    EXPECT_EQ(why.exit_code, 0) << why.err;
    const ChildResult again = run_soda({"replay", log, "--as-executed"});
    EXPECT_EQ(again.exit_code, 0) << again.err;
  }
}

TEST_F(Mpi, FewerWorldsThanRanksAndOneWorldRunToo) {
  const std::string digest =
      after("digest of the state after the last step",
            run_soda({"run", library_file("border-stack"), "--steps", "9"}).out);
  for (const char* worlds : {"1", "2"}) {
    const ChildResult found = run_job(4, {"run", library_file("border-stack"), "--steps", "9",
                                          "--worlds", worlds, "--executor", "mpi"});
    EXPECT_EQ(found.exit_code, 0) << found.err;
    EXPECT_EQ(after("digest of the state after the last step", found.out), digest);
  }
}

// Ranks that have several worlds, one or none.
TEST_F(Mpi, ARunIsShownInOrderWhileAllRanksComputeIt) {
  const std::vector<std::string> run = {
      "run", library_file("border-stack"), "--steps", "30", "--quiet", "--json"};
  const Json plain = Json::parse(run_soda(run).out);
  for (const auto& [ranks, worlds, policy] :
       {std::tuple(2, "4", "optimistic"), {3, "2", "lockstep"}, {2, "1", "optimistic"}}) {
    std::vector<std::string> job = run;
    for (const char* more : {"--executor", "mpi", "--worlds", worlds, "--policy", policy,
                             "--realtime", "--fps", "120", "--speed", "2", "--load", "0.1"})
      job.push_back(more);
    const ChildResult found = run_job(ranks, job);
    ASSERT_EQ(found.exit_code, 0) << found.err;
    const Json json = Json::parse(found.out);
    EXPECT_EQ(json["digest"], plain["digest"]);
    const Json& shown = json["real_time"];
    EXPECT_EQ(shown["clock"].front(), 0);
    EXPECT_EQ(shown["clock"].back(), 30);
    EXPECT_EQ(shown["fill"].front(), 30) << "frames begin when all worlds have all entries";
    for (std::size_t i = 1; i < shown["clock"].size(); ++i) {
      const int advance = shown["clock"][i].get<int>() - shown["clock"][i - 1].get<int>();
      EXPECT_EQ(advance, shown["fate"][i] == "late" ? 0 : 1) << i;
    }
  }
}

// The peak is that of a world of the other rank, which has to know when frames begin; and the root
// has to hear what it has worked.
TEST_F(Mpi, AnOverloadOnAnotherRankEmptiesTheBufferOfAll) {
  const ChildResult job = run_job(
      2,
      {"anticipation", "--worlds",      "2",     "--mode",      "measured", "--buffers",   "8",
       "--peak",       "1@0.5",         "--fps", "40",          "--speed",  "0.66",        "--lead",
       "12",           "--utilisation", "0.05",  "--overloads", "59",       "--max-steps", "50",
       "--quiet",      "--json"});
  ASSERT_EQ(job.exit_code, 0) << job.err;
  const Json point = Json::parse(job.out)["points"].back();
  EXPECT_EQ(point["mode"], "measured");
  EXPECT_EQ(point["late_before_peak"], false);
  EXPECT_NEAR(point["ratio"].get<double>(), 3.0, 0.15) << point;
  EXPECT_GE(point["filled"], 8);
  EXPECT_LE(point["steps_until_late"].get<int>(), point["law_steps"].get<int>() + 3) << point;
}

// Of three and of six workers; one of the scenes has four worlds only.
TEST_F(Mpi, RunsOverRanksArePredictedByCostsMeasuredBefore) {
  const TemporaryFolder folder;
  const std::string costs = folder.file("costs.json");
  ASSERT_EQ(run_soda({"calibrate", library_file("third-world"), "--steps", "5", "--repeat", "1",
                      "-o", costs})
                .exit_code,
            0);
  const ChildResult job =
      run_job(3, {"calibrate", "--costs", costs, library_file("eight-corner"),
                  library_file("third-world"), "--steps", "5", "--predict", "1,2", "--json"});
  ASSERT_EQ(job.exit_code, 0) << job.err;
  const Json predictions = Json::parse(job.out)["predictions"];
  std::vector<std::pair<std::string, int>> found;
  for (const Json& of : predictions) {
    found.emplace_back(of["scenario"], of["threads"]);
    EXPECT_EQ(of["ranks"], 3);
    EXPECT_EQ(of["equal"], true);
    EXPECT_GT(of["predicted_s"], 0.0);
    EXPECT_GT(of["measured_s"], 0.0);
  }
  EXPECT_EQ(found, (decltype(found){{"eight-corner", 1}, {"eight-corner", 2}, {"third-world", 1}}));
}

TEST_F(Mpi, AnErrorIsPrintedOnceAndFirstAndEndsAllRanksWithItsCode) {
  const TemporaryFolder folder;
  const std::string scene = library_file("border-stack");
  struct Case {
    std::vector<std::string> arguments;
    int code;
    std::string message;
  };
  const std::vector<Case> cases = {
      {{"run", "/nowhere.json", "--executor", "mpi"}, 3, "soda: /nowhere.json: cannot be read"},
      {{"run", scene, "--executor", "threads"}, 2, "soda: started by mpirun with another"},
      {{"run", scene, "--worlds", "0", "--executor", "mpi"}, 2, "soda: --worlds"},
      {{"plan", scene}, 2, "soda: started by mpirun; only"},
      {{"anticipation", scene, "--over", "makespan"}, 2, "soda: --over makespan: it runs on"},
      {{"calibrate", scene, "--predict", "1"}, 2, "soda: --costs is required over ranks"},
      {{"phold", "--end", "5"}, 2, "soda: --executor mpi and mpirun belong together"},
      // Only the root opens it, while the others are on their way into the run.
      {{"run", scene, "--executor", "mpi", "--log", "/nowhere/run.sodalog"},
       3,
       "soda: /nowhere/run.sodalog"},
  };
  for (const Case& wrong : cases) {
    const ChildResult job = run_job(2, wrong.arguments);
    EXPECT_EQ(job.exit_code, wrong.code) << job.err;
    EXPECT_EQ(job.err.find(wrong.message), 0u) << job.err;
    EXPECT_EQ(count("soda: ", job.err), 1u) << job.err;
    EXPECT_EQ(job.out, "");
  }
  const ChildResult alone = run_soda({"run", scene, "--executor", "mpi"});
  EXPECT_EQ(alone.exit_code, 2);
  EXPECT_EQ(alone.err.find("soda: --executor mpi: start the program with mpirun"), 0u) << alone.err;
}

// A write error happens at commit, when all ranks are in the run.
TEST_F(Mpi, AnErrorDuringTheRunEndsTheJob) {
  const ChildResult job =
      run_job(2, {"run", library_file("twelve-worlds"), "--executor", "mpi", "--log", "/dev/full"});
  EXPECT_EQ(job.exit_code, 3) << job.err;
  EXPECT_EQ(job.err.find("soda: /dev/full"), 0u) << job.err;
}

// Process ids of soda whose command line holds `part`.
std::vector<pid_t> soda_processes_with(const std::string& part) {
  std::vector<pid_t> found;
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    std::ifstream file(entry.path() / "cmdline", std::ios::binary);
    std::stringstream line;
    if (file) line << file.rdbuf();
    const std::string program = line.str().substr(0, line.str().find('\0'));
    if (program.ends_with("/soda") && line.str().find(part) != std::string::npos)
      found.push_back(std::stoi(entry.path().filename()));
  }
  return found;
}

TEST_F(Mpi, AKilledRankEndsTheJobWithinSeconds) {
  // A run that would take hours, marked by its seed.
  const std::string seed = std::to_string(1'000'000 + getpid());
  ChildResult job;
  std::thread runs([&] {
    job =
        run_job(3, {"phold", "--end", "1e8", "--window", "5", "--seed", seed, "--executor", "mpi"});
  });
  std::vector<pid_t> ranks;
  for (int look = 0; look < 100 && ranks.size() < 3; ++look) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    ranks = soda_processes_with(seed);
  }
  ASSERT_EQ(ranks.size(), 3u);
  std::this_thread::sleep_for(std::chrono::seconds(1));
  const auto start = std::chrono::steady_clock::now();
  ASSERT_EQ(kill(ranks[1], SIGKILL), 0);
  runs.join();
  const auto took = std::chrono::steady_clock::now() - start;
  EXPECT_NE(job.exit_code, 0);
  EXPECT_LT(took, std::chrono::seconds(10));
  EXPECT_NE(job.err.find("signal 9"), std::string::npos) << job.err;
  EXPECT_TRUE(soda_processes_with(seed).empty());
}

// One rank gets the signal; all agree where to end.
TEST_F(Mpi, ASignalToAnyRankEndsTheRunAtACommitWithItsReport) {
  for (const std::size_t rank : {0u, 2u}) {
    const TemporaryFolder folder;
    const std::string log = folder.file("run.sodalog");
    ChildResult job;
    std::thread runs([&] {
      job = run_job(3, {"run", library_file("border-stack"), "--executor", "mpi", "--threads", "2",
                        "--steps", "10000000", "--log", log});
    });
    std::vector<pid_t> ranks;
    for (int look = 0; look < 100 && ranks.size() < 3; ++look) {
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      ranks = soda_processes_with(log);
    }
    EXPECT_EQ(ranks.size(), 3u);
    std::this_thread::sleep_for(std::chrono::seconds(2));
    EXPECT_EQ(kill(ranks[rank], SIGINT), 0);
    runs.join();
    EXPECT_EQ(job.exit_code, 130) << job.err;
    EXPECT_NE(job.out.find("ended early by SIGINT, after step "), std::string::npos) << job.out;
    const ChildResult replay = run_soda({"replay", log});
    EXPECT_EQ(replay.exit_code, 0) << replay.err;
    EXPECT_NE(replay.out.find(after("after the last step  ", job.out)), std::string::npos);
  }
}

}  // namespace
}  // namespace soda
