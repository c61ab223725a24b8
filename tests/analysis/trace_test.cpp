// What a trace tells of a run: through the binary, against the run's own counters.
#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "analysis/child_process.hpp"
#include "analysis/event_log/log_reader.hpp"
#include "analysis/forged_log.hpp"
#include "analysis/text/exit_codes.hpp"
#include "kernel/api/event_recorder.hpp"

namespace soda::analysis {
namespace {

using analysis_test::ChildResult;
using analysis_test::contains;
using analysis_test::forge_log;
using analysis_test::ForgedBlock;
using analysis_test::library_file;
using analysis_test::read_file;
using analysis_test::run_soda;
using analysis_test::TemporaryFolder;
using nlohmann::json;

class Trace : public testing::Test {
 protected:
  // The run with a trace in log_, as its --json tells it.
  json traced(const std::string& scene, const std::vector<std::string>& options) const {
    std::vector<std::string> command = {
        "run",   library_file(scene), "--log",  log_,     "--log-level",
        "trace", "--force",           "--json", "--quiet"};
    command.insert(command.end(), options.begin(), options.end());
    const ChildResult ran = run_soda(command);
    EXPECT_EQ(ran.exit_code, kExitOk) << ran.err;
    return json::parse(ran.out);
  }
  json why(const std::vector<std::string>& options = {}) const {
    std::vector<std::string> command = {"why", log_, "--json"};
    command.insert(command.end(), options.begin(), options.end());
    const ChildResult told = run_soda(command);
    EXPECT_EQ(told.exit_code, kExitOk) << told.err;
    return json::parse(told.out);
  }

  const TemporaryFolder folder_;
  const std::string log_ = folder_.file("run.sodalog");
};

// All that the run has counted, counted again from what was written down of each event.
void expect_equal_sums(const json& run, const json& events) {
  std::map<std::string, std::int64_t> sums;
  for (const json& event : events) {
    ++sums[event["what"]];
    if (event["what"] == "sent") ++sums[event["anti"] ? "anti" : "message"];
    if (event["what"] == "absorbed" && event["anew"]) ++sums["executed"];
  }
  const json& counted = run["events"];
  EXPECT_EQ(sums["executed"], counted["executed"]);
  EXPECT_EQ(sums["rolled_back"] - sums["put_back"], counted["rolled_back"]);
  EXPECT_EQ(sums["committed"], counted["committed"]);
  EXPECT_EQ(sums["rewound"], counted["rollbacks"]);
  EXPECT_EQ(sums["late"], counted["stragglers"]);
  EXPECT_EQ(sums["message"], counted["messages"]);
  EXPECT_EQ(sums["anti"], counted["anti_messages"]);
  EXPECT_EQ(sums["adopted"], counted["adopted"]);
  EXPECT_EQ(sums["absorbed"], counted["absorbed"]);
  EXPECT_EQ(sums["jumped"], counted["jumps"]);
}

void expect_equal_kinds(const json& run, const json& events) {
  std::map<std::string, std::map<std::string, std::int64_t>> kinds, messages;
  for (const json& event : events) {
    const std::string what = event["what"];
    if (what == "sent") ++messages[event["message"]][event["anti"] ? "anti" : "sent"];
    if (what == "late") ++messages[event["message"]]["late"];
    if (!event["event"].is_string()) continue;
    std::string kind = event["event"];
    std::replace(kind.begin(), kind.end(), ' ', '_');
    if (what == "executed" || (what == "absorbed" && event["anew"])) ++kinds[kind]["executed"];
    if (what == "rolled_back") ++kinds[kind]["rolled_back"];
    if (what == "put_back") --kinds[kind]["rolled_back"];
    if (what == "committed") ++kinds[kind]["committed"];
  }
  for (const auto& [name, counts] : run["events"]["by_kind"].items())
    for (const auto& [what, count] : counts.items())
      EXPECT_EQ(kinds[name][what], count) << name << " " << what;
  for (const auto& [name, counts] : run["events"]["messages_by_kind"].items())
    for (const auto& [what, count] : counts.items())
      EXPECT_EQ(messages[name][what], count) << name << " " << what;
}

TEST_F(Trace, SumsAreTheCountersOfTheRunUnderEveryExecutor) {
  const std::vector<std::vector<std::string>> all = {
      {"--executor", "sequential"},
      {"--executor", "virtual"},
      {"--executor", "virtual", "--gating", "off", "--latency-us", "60"},
      {"--executor", "virtual", "--policy", "lockstep"},
      {"--threads", "2"},
      {"--threads", "4", "--scheduling-seed", "7", "--gating", "off"},
      {"--threads", "2", "--rollback", "invalidate", "--gating", "off"}};
  std::uint64_t rolled_back = 0;
  for (std::vector<std::string> options : all) {
    options.insert(options.end(), {"--steps", "100"});
    const json run = traced("border-stack", options);
    const json events = json::parse(run_soda({"log", log_, "--json", "--lines", "events"}).out);
    SCOPED_TRACE(options[1]);
    expect_equal_sums(run, events);
    expect_equal_kinds(run, events);
    rolled_back += run["events"]["rolled_back"].get<std::uint64_t>();
  }
  EXPECT_GT(rolled_back, 5000u);
}

TEST_F(Trace, ARunIsTheSameWithAndWithoutOne) {
  const json with = traced("crowd", {"--executor", "virtual", "--gating", "off", "--steps", "40"});
  const json without = json::parse(run_soda({"run", library_file("crowd"), "--executor", "virtual",
                                             "--gating", "off", "--steps", "40", "--json"})
                                       .out);
  EXPECT_EQ(with["digest"], without["digest"]);
  EXPECT_EQ(with["virtual"], without["virtual"]);
  EXPECT_EQ(with["events"], without["events"]);
}

// Two pairs of balls, each of two worlds; each meets in a world that owns neither.
TEST_F(Trace, WhyNamesThePairsThatMeetInAThirdWorld) {
  traced("third-world", {"--executor", "virtual"});
  using Pairs = std::set<std::pair<int, int>>;
  Pairs met;
  const json told = why({"--all"});
  for (const json& rollback : told["found"])
    if (rollback["reason"] == "touches" || rollback["reason"] == "touched") {
      const int a = rollback["body"], b = rollback["other_body"];
      met.emplace(std::min(a, b), std::max(a, b));
    }
  EXPECT_EQ(met, (Pairs{{0, 1}, {2, 3}})) << told;
  // Nobody asks a world about ghosts that are all gone.
  std::size_t gone = 0;
  for (const json& rollback : told["found"]) {
    if (!std::ranges::all_of(rollback["late"], [](const json& m) { return m["anti"] == true; }))
      continue;
    EXPECT_EQ(rollback["reason"], "unknown") << rollback;
    ++gone;
  }
  EXPECT_GT(gone, 0u);
}

TEST_F(Trace, WhyNamesTheBallAndWhatItHits) {
  traced("border-stack", {"--executor", "virtual", "--gating", "off"});
  constexpr int kBall = 100;
  const json found = why({"--body", "100", "--all"})["found"];
  std::size_t hits = 0;
  for (const json& rollback : found)
    hits += (rollback["reason"] == "touches" || rollback["reason"] == "touched") &&
            (rollback["body"] == kBall || rollback["other_body"] == kBall);
  EXPECT_GT(hits, 0u);
  const ChildResult told = run_soda({"why", log_, "--body", "100"});
  // Whichever of the two worlds went back first.
  EXPECT_TRUE(contains(told.out, "body 100 touches body ") ||
              contains(told.out, " touches body 100."))
      << told.out.substr(0, 2000);
}

// What the run has counted as late migrations is what the rollbacks are told to come of.
TEST_F(Trace, WhyTellsWhichRollbacksComeOfLateMigrants) {
  const json run = traced("crowd", {"--executor", "virtual", "--steps", "100"});
  const json told = why({"--all"});
  EXPECT_EQ(told["rollbacks"], run["events"]["rollbacks"]);
  std::size_t of_migrants = 0, with_migrant = 0, names_bodies = 0;
  std::set<std::string> late;
  for (const json& rollback : told["found"]) {
    of_migrants += rollback["cause"] == "migration" || rollback["cause"] == "taken back: migration";
    bool has_one = false;
    for (const json& message : rollback["late"]) {
      EXPECT_TRUE(late.insert(message["message"]).second);
      if (message["kind"] != "migration") continue;
      has_one = true;
      names_bodies += !message["bodies"].empty();
    }
    with_migrant += has_one;
  }
  EXPECT_GT(of_migrants, 0u);
  EXPECT_GE(with_migrant, of_migrants);
  EXPECT_GT(names_bodies, 0u);  // but where a neighbour says that nobody comes
  for (const json& cause : told["causes"]) {
    if (cause["cause"] == "migration") {
      EXPECT_LE(cause["rollbacks"], of_migrants);
    }
  }
}

// The causal chain ends with something that was sent for the first time, or from outside.
TEST_F(Trace, EveryChainOfCausesHasAnEnd) {
  traced("border-stack",
         {"--executor", "virtual", "--gating", "off", "--latency-us", "60", "--steps", "90"});
  const json found = why({"--all"})["found"];
  ASSERT_GT(found.size(), 50u);
  std::size_t followed = 0;
  for (const json& rollback : found) {
    EXPECT_FALSE(rollback["late"].empty());
    json at = rollback;
    while (!at["because_of"].is_null()) {
      const std::size_t cause = at["because_of"];
      ASSERT_LT(cause, at["rollback"].get<std::size_t>());
      at = found[cause - 1];
      ++followed;
    }
  }
  EXPECT_GT(followed, found.size() / 2);
}

// For every rollback: with the messages that led to it in time, they lead to none.
TEST_F(Trace, AMessageDeliveredInTimeIsNotLate) {
  std::size_t checked = 0;
  const std::vector<std::pair<const char*, const char*>> runs = {
      {"third-world", "60"}, {"border-stack", "86"}, {"crowd", "40"}};
  for (const auto& [scene, steps] : runs) {
    traced(scene, {"--executor", "virtual", "--steps", steps});
    const json found = why({"--all"})["found"];
    for (const json& rollback : found)
      for (const json& message : rollback["late"]) {
        const std::string name = message["message"];
        const ChildResult ran = run_soda({"what-if", log_, "--deliver-in-time", name, "--json"});
        ASSERT_EQ(ran.exit_code, kExitOk) << name << ": " << ran.err;
        const json what = json::parse(ran.out);
        EXPECT_FALSE(what["message_was_late"]) << scene << " " << name;
        EXPECT_EQ(what["before"]["digest"], what["after"]["digest"]);
        ++checked;
      }
  }
  EXPECT_GT(checked, 20u);
}

TEST_F(Trace, WhatIfTellsTheCostBeforeAndAfter) {
  const json run = traced("border-stack", {"--executor", "virtual", "--gating", "off"});
  const ChildResult ran = run_soda({"what-if", log_, "--gating", "on", "--json"});
  ASSERT_EQ(ran.exit_code, kExitOk) << ran.err;
  const json what = json::parse(ran.out);
  EXPECT_EQ(what["change"], "gating on");
  EXPECT_EQ(what["before"]["rolled_back"], run["events"]["rolled_back"]);
  EXPECT_EQ(what["before"]["makespan_s"], run["virtual"]["makespan_s"]);
  EXPECT_LT(what["after"]["rolled_back"], what["before"]["rolled_back"]);
  EXPECT_EQ(what["after"]["digest"], run["digest"]);
  EXPECT_EQ(run_soda({"what-if", log_}).exit_code, kExitInput);
  EXPECT_EQ(run_soda({"what-if", log_, "--deliver-in-time", "0:999999"}).exit_code, kExitInput);
  EXPECT_EQ(run_soda({"what-if", log_, "--deliver-in-time", "box"}).exit_code, kExitInput);
}

// Event for event, the same rollbacks in one thread; and nothing else is taken for the same.
TEST_F(Trace, ARunOverThreadsOrRanksIsHadAgainAsItWasExecuted) {
  const std::vector<std::vector<std::string>> all = {
      {"--threads", "2"},
      {"--threads", "4", "--gating", "off"},
      {"--threads", "4", "--scheduling-seed", "3"},
      {"--threads", "3", "--rollback", "invalidate", "--gating", "off"},
      {"--executor", "virtual", "--latency-us", "60"},
      {"--threads", "2", "--gating", "off", "--balancing", "random", "--balancing-interval", "3"},
      {"--executor", "virtual", "--balancing", "paper", "--jitter-us", "20"},
      {"--executor", "virtual", "--policy", "lockstep", "--balancing", "random"}};
  std::uint64_t rolled_back = 0;
  for (const char* scene : {"border-stack", "billiards", "third-world", "user-input"})
    for (std::vector<std::string> options : all) {
      options.insert(options.end(), {"--steps", "90"});
      json run = traced(scene, options)["events"];
      const ChildResult again = run_soda({"replay", log_, "--as-executed", "--json"});
      EXPECT_EQ(again.exit_code, kExitOk) << scene << " " << options[1] << again.err;
      json told = json::parse(again.out)["events"];
      rolled_back += run["rolled_back"].get<std::uint64_t>();
      for (const char* key :
           {"executed", "rolled_back", "committed", "rollbacks", "stragglers", "messages",
            "anti_messages", "adopted", "absorbed", "jumps", "by_kind", "messages_by_kind"})
        EXPECT_EQ(run[key], told[key]) << scene << " " << key;
    }
  EXPECT_GT(rolled_back, 2000u);
  traced("border-stack", {"--threads", "4", "--gating", "off", "--steps", "90"});
  EXPECT_EQ(run_soda({"replay", log_, "--as-executed", "--rollback", "invalidate"}).exit_code,
            kExitCheckFailed);
  traced("border-stack", {"--executor", "sequential", "--steps", "30"});
  const ChildResult refused = run_soda({"replay", log_, "--as-executed"});
  EXPECT_EQ(refused.exit_code, kExitInput);
  EXPECT_TRUE(contains(refused.err, "a run in sequence, which has one order only")) << refused.err;
}

// Slices of a track follow each other or lie within each other, and arrows have both ends.
TEST_F(Trace, ATraceFileHasASliceForEachExecutionOnBothTracks) {
  const json run = traced("border-stack", {"--threads", "2"});
  const std::string file = folder_.file("trace.json");
  ASSERT_EQ(run_soda({"trace", log_, "-o", file}).exit_code, kExitOk);
  std::map<int, std::uint64_t> slices;
  std::map<std::uint64_t, int> arrows;
  const json trace = json::parse(read_file(file));
  for (const json& event : trace["traceEvents"]) {
    if (event["ph"] == "X") ++slices[event["pid"]];
    if (event["ph"] == "s" || event["ph"] == "f") ++arrows[event["id"]];
    if (event["ph"] == "X") {
      EXPECT_GE(event["dur"], 0.0);
    }
  }
  EXPECT_EQ(slices[1], slices[2]);
  EXPECT_LE(slices[1], run["events"]["executed"]);
  EXPECT_GE(slices[1] + run["events"]["absorbed"].get<std::uint64_t>(), run["events"]["executed"]);
  for (const auto& [id, ends] : arrows) EXPECT_EQ(ends, 2) << id;
  EXPECT_EQ(run_soda({"trace", log_, "-o", file}).exit_code, kExitFile);
  EXPECT_EQ(run_soda({"trace", log_, "-o", log_, "--force"}).exit_code, kExitInput);
}

TEST_F(Trace, LevelsAndIntervalsLeaveOutWhatTheySay) {
  const auto log_of = [this](std::vector<std::string> options) {
    options.insert(options.begin(), {"run", library_file("border-stack"), "--steps", "20", "--log",
                                     log_, "--force"});
    EXPECT_EQ(run_soda(options).exit_code, kExitOk);
  };
  log_of({"--log-level", "inputs"});
  EXPECT_EQ(run_soda({"replay", log_}).exit_code, kExitOk);
  EXPECT_EQ(run_soda({"replay", log_, "--step", "3"}).exit_code, kExitInput);
  EXPECT_EQ(run_soda({"view", log_, "-o", folder_.file("v.html")}).exit_code, kExitInput);
  EXPECT_EQ(run_soda({"why", log_}).exit_code, kExitInput);
  log_of({"--log-every", "8"});
  EXPECT_EQ(run_soda({"replay", log_}).exit_code, kExitOk);
  EXPECT_EQ(run_soda({"replay", log_, "--step", "16"}).exit_code, kExitOk);
  const ChildResult between = run_soda({"replay", log_, "--step", "17"});
  EXPECT_EQ(between.exit_code, kExitInput);
  EXPECT_TRUE(contains(between.err, "the last are of step 16")) << between.err;
  const std::string states = run_soda({"log", log_, "--csv", "--lines", "states"}).out;
  EXPECT_EQ(std::count(states.begin(), states.end(), '\n'), 1 + 3 * 11);
  EXPECT_EQ(run_soda({"view", log_, "-o", folder_.file("v.html")}).exit_code, kExitOk);
  EXPECT_EQ(run_soda({"run", library_file("border-stack"), "--log-level", "trace"}).exit_code,
            kExitInput);
}

// Sound checksums around a trace that no soda wrote.
TEST_F(Trace, WhatNoSodaWroteIsTold) {
  traced("border-stack", {"--executor", "virtual", "--steps", "60"});
  const std::string forged = folder_.file("forged.sodalog");
  const std::vector<std::pair<std::size_t, unsigned char>> changes = {
      {0, 0xff}, {1, 0x0f}, {1, 0x3d}, {5, 0x7f}, {9, 0xff}, {40, 0x83}, {1000, 0x55}};
  std::size_t refused = 0;
  for (const auto& [at, value] : changes) {
    bool is_done = false;
    forge_log(log_, forged, [&](ForgedBlock& block) {
      if (block.type != BlockType::kTrace || is_done) return;
      block.payload.at(at) ^= value;
      is_done = true;
    });
    ASSERT_TRUE(is_done);
    for (const char* command : {"why", "log", "trace"}) {
      std::vector<std::string> line = {command, forged};
      if (line[0] == "log") line.insert(line.end(), {"--csv", "--lines", "events"});
      if (line[0] == "trace") line.insert(line.end(), {"-o", folder_.file("t.json"), "--force"});
      const ChildResult told = run_soda(line);
      EXPECT_TRUE(told.exit_code == kExitFile || told.exit_code == kExitOk)
          << command << " " << at << ": " << told.exit_code << " signal " << told.signal
          << told.err;
      refused += told.exit_code == kExitFile;
      EXPECT_TRUE(told.exit_code == kExitOk || contains(told.err, "trace block ")) << told.err;
    }
  }
  EXPECT_GE(refused, 6u);
}

TEST_F(Trace, ACutLogTellsOfWhatItHas) {
  traced("border-stack", {"--executor", "virtual", "--gating", "off", "--steps", "120"});
  const std::string whole = read_file(log_);
  analysis_test::write_file(log_, whole.substr(0, whole.size() * 2 / 3));
  const ChildResult told = run_soda({"why", log_});
  EXPECT_EQ(told.exit_code, kExitOk) << told.err;
  EXPECT_TRUE(contains(told.err, "cut off")) << told.err;
}

}  // namespace
}  // namespace soda::analysis
