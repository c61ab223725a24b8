// Stopping a replay at an event, and walking through a trace by commands: through the binary.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "analysis/child_process.hpp"
#include "analysis/event_log/log_reader.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/text_table.hpp"

namespace soda::analysis {
namespace {

using analysis_test::ChildResult;
using analysis_test::contains;
using analysis_test::library_file;
using analysis_test::read_file;
using analysis_test::run_soda;
using analysis_test::TemporaryFolder;
using analysis_test::write_file;
using nlohmann::json;

class TracedReplay : public testing::Test {
 protected:
  void run(const std::string& scene, const std::vector<std::string>& options,
           const std::string& level = "trace") const {
    std::vector<std::string> command = {
        "run", library_file(scene), "--log", log_, "--log-level", level, "--force"};
    command.insert(command.end(), options.begin(), options.end());
    const ChildResult ran = run_soda(command);
    ASSERT_EQ(ran.exit_code, kExitOk) << ran.err;
  }
  json stopped(const std::string& option, const std::string& event) const {
    const ChildResult told = run_soda({"replay", log_, option, event, "--json"});
    EXPECT_EQ(told.exit_code, kExitOk) << event << ": " << told.err;
    return told.exit_code == kExitOk ? json::parse(told.out) : json();
  }
  ChildResult session(const std::string& commands) const {
    const std::string script = folder_.file("script");
    write_file(script, commands);
    return run_soda({"replay", log_, "--interactive"},
                    {[script] { dup2(open(script.c_str(), O_RDONLY), STDIN_FILENO); }, [](int) {}});
  }
  std::string refusal(const std::string& option, const std::string& event) const {
    const ChildResult told = run_soda({"replay", log_, option, event});
    EXPECT_EQ(told.exit_code, kExitInput) << event << told.out;
    return told.err;
  }

  const TemporaryFolder folder_;
  const std::string log_ = folder_.file("run.sodalog");
};

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines(1);
  for (const char c : text)
    if (c == '\n')
      lines.emplace_back();
    else
      lines.back() += c;
  lines.pop_back();
  return lines;
}

std::uint64_t rollbacks_in(const json& stop) {
  std::uint64_t sum = 0;
  for (const json& world : stop["worlds"]) sum += world["rollbacks"].get<std::uint64_t>();
  return sum;
}

// How many bodies of a stop are, to the bit, as the log has them after the same step; and others.
std::pair<std::size_t, std::size_t> as_committed(const json& stop, LogReader& log) {
  std::pair<std::size_t, std::size_t> alike_and_others;
  for (const json& body : stop["bodies"]) {
    const LoggedStep step = log.read_states(body["step"]);
    const auto label = std::ranges::find(log.labels(), body["body"].get<std::uint32_t>());
    const physics::BodyId id{static_cast<std::uint32_t>(label - log.labels().begin())};
    const auto at = std::ranges::lower_bound(step.ids, id) - step.ids.begin();
    const physics::BodyState& state = step.states.at(static_cast<std::size_t>(at));
    bool is_alike = true;
    for (int axis = 0; axis < 3; ++axis) {
      is_alike = is_alike && body["position_m"][axis] == state.position_m[axis] &&
                 body["linear_velocity_m_s"][axis] == state.linear_velocity_m_s[axis];
    }
    ++(is_alike ? alike_and_others.first : alike_and_others.second);
  }
  return alike_and_others;
}

const std::vector<std::vector<std::string>> kRuns = {
    {"--executor", "virtual", "--gating", "off", "--latency-us", "60", "--steps", "90"},
    {"--threads", "2", "--gating", "off", "--steps", "90"},
    {"--threads", "4", "--gating", "off", "--scheduling-seed", "5", "--steps", "90"}};

TEST_F(TracedReplay, BreakStopsBeforeTheRollbackAndUntilAfterIt) {
  std::size_t checked = 0;
  for (const std::vector<std::string>& options : kRuns) {
    run("border-stack", options);
    const json why = json::parse(run_soda({"why", log_, "--json"}).out);
    if (why["rollbacks"] == 0) continue;
    ++checked;
    const json before = stopped("--break", "rollback"), after = stopped("--until", "rollback");
    EXPECT_EQ(after["happening"], before["happening"].get<std::size_t>() + 1);
    EXPECT_EQ(rollbacks_in(before), 0u);
    EXPECT_EQ(rollbacks_in(after), 1u);
    EXPECT_EQ(before["story"], after["story"]);
    EXPECT_TRUE(contains(before["story"], "went back to step ")) << before["story"];
    EXPECT_TRUE(contains(after["place"], " rolls back to step ")) << after["place"];
    const std::string told = run_soda({"replay", log_, "--break", "rollback"}).out;
    EXPECT_TRUE(contains(told, "what comes next: world ")) << told;
    EXPECT_TRUE(contains(told, "executed up to (LVT)")) << told;
  }
  EXPECT_GE(checked, 1u);
}

// What was speculative is shown as it was: with what it was rolled back for, then without.
TEST_F(TracedReplay, StatesAreThoseThatWorldsHadThen) {
  std::size_t wrong = 0;
  for (const std::vector<std::string>& options : kRuns) {
    run("border-stack", options);
    LogReader log(log_);
    const std::size_t happenings = stopped("--until", "happening:1")["happenings"];
    const json end = stopped("--until", "happening:" + std::to_string(happenings));
    for (const json& world : end["worlds"]) {
      EXPECT_EQ(world["committed"], "step 89, finish");
      EXPECT_EQ(world["events_ahead"], 0);
      EXPECT_EQ(world["messages_in_flight"], 0);
    }
    const auto [alike, others] = as_committed(end, log);
    EXPECT_GE(alike, log.labels().size());
    EXPECT_EQ(others, 0u);
    for (const std::size_t at : {happenings / 4, happenings / 2, 3 * happenings / 4}) {
      const json stop = stopped("--until", "happening:" + std::to_string(at));
      wrong += as_committed(stop, log).second;
    }
  }
  EXPECT_GT(wrong, 0u);
}

TEST_F(TracedReplay, EventsAreFoundByTheirNames) {
  run("border-stack", kRuns[0]);
  EXPECT_TRUE(
      contains(stopped("--until", "world:1:20:pairs")["place"], "world 1 executed step 20, pairs"));
  EXPECT_TRUE(
      contains(stopped("--until", "world:1:20")["place"], "world 1 executed step 20, begin"));
  EXPECT_TRUE(contains(stopped("--until", "30")["place"], " executed step 30, "));
  EXPECT_TRUE(contains(stopped("--until", "message:1:7")["place"], "(message 1:7)"));
  EXPECT_GE(stopped("--until", "gvt:40")["gvt_step"], 40);
  EXPECT_EQ(stopped("--until", "happening:12")["happening"], 12);
  EXPECT_TRUE(contains(refusal("--until", "wolrd:1:2"), "did you mean world?"));
  EXPECT_TRUE(contains(refusal("--until", "world:9:2"), "\"9\" for a number; allowed: 0 to "));
  EXPECT_TRUE(contains(refusal("--until", "world:1:2:pears"), "did you mean pairs?"));
  EXPECT_TRUE(contains(refusal("--until", "message:1"), "allowed: STEP, world:WORLD:STEP"));
  EXPECT_TRUE(contains(refusal("--until", "message:1:99999999"), "tells of no message:1:99999999"));
  EXPECT_TRUE(contains(refusal("--break", "rollback:0:5000"), "tells of no rollback:0:5000"));
  EXPECT_EQ(run_soda({"replay", log_, "--until", "3", "--threads", "2"}).exit_code, kExitInput);
  run("border-stack", {"--steps", "10", "--executor", "virtual"}, "commits");
  EXPECT_TRUE(contains(refusal("--until", "3"), "--log-level trace writes it"));
}

// Inputs, of a stream as well, and cells that change hands come from outside again as they did.
TEST_F(TracedReplay, WhatCameFromOutsideComesAgain) {
  std::size_t rollbacks = 0, transfers = 0;
  for (const std::vector<std::string>& options : std::vector<std::vector<std::string>>{
           {"--threads", "2", "--gating", "off"},
           {"--threads", "3", "--policy", "lockstep", "--balancing", "random"},
           {"--executor", "virtual", "--worlds", "1"},
           {"--executor", "virtual", "--policy", "lockstep"},
           {"--executor", "virtual", "--balancing", "random", "--balancing-interval", "3"},
           {"--executor", "virtual", "--realtime", "--speed", "8"}}) {
    run("user-input", options);
    LogReader log(log_);
    for (std::int64_t step = 1; step <= log.last_step(); ++step)
      transfers += log.read_step(step).territory_changes.size();
    const std::size_t happenings = stopped("--until", "20")["happenings"];
    for (const std::size_t at : {happenings / 3, happenings / 2, happenings}) {
      const json stop = stopped("--until", "happening:" + std::to_string(at));
      const auto [alike, others] = as_committed(stop, log);
      EXPECT_GT(alike, 0u);
      if (at == happenings) {
        EXPECT_EQ(others, 0u) << options[1];
      }
    }
    if (json::parse(run_soda({"why", log_, "--json"}).out)["rollbacks"] == 0) continue;
    ++rollbacks;
    const json before = stopped("--break", "rollback"), after = stopped("--until", "rollback");
    EXPECT_EQ(after["happening"], before["happening"].get<std::size_t>() + 1);
    EXPECT_EQ(rollbacks_in(after), 1u);
  }
  EXPECT_GE(rollbacks, 2u);
  EXPECT_GT(transfers, 10u);
}

TEST_F(TracedReplay, ARunInSequenceStopsWhereverItWasAndHasNoRollback) {
  for (const char* worlds : {"1", "4"}) {
    run("user-input", {"--executor", "sequential", "--worlds", worlds});
    LogReader log(log_);
    const std::size_t happenings = stopped("--until", "20")["happenings"];
    for (const std::string& event :
         {std::string("30"), std::string("world:0:50:finish"), std::string("gvt:70"),
          "happening:" + std::to_string(happenings)}) {
      const json stop = stopped("--until", event);
      const auto [alike, others] = as_committed(stop, log);
      EXPECT_GT(alike, 0u) << event;
      EXPECT_EQ(others, 0u) << event << ": nothing is speculative";
      for (const json& world : stop["worlds"]) EXPECT_EQ(world["messages_in_flight"], 0);
    }
    EXPECT_EQ(stopped("--until", "gvt:70")["gvt_step"], 70);
    EXPECT_TRUE(contains(refusal("--break", "rollback"), "in sequence nothing is rolled back"));
    const ChildResult walked = session("goto 30\nworld\nbody 1 now\n");
    EXPECT_EQ(walked.exit_code, kExitOk) << walked.err;
    EXPECT_TRUE(contains(walked.out, " has body 1 after step 30")) << walked.out;
  }
  const json events = json::parse(run_soda({"log", log_, "--json", "--lines", "events"}).out);
  const auto sent =
      std::ranges::find(events, "sent", [](const json& event) { return event["what"]; });
  ASSERT_NE(sent, events.end());
  const std::string name = "message:" + std::to_string((*sent)["world"].get<int>()) + ":" +
                           std::to_string((*sent)["number"].get<int>());
  EXPECT_TRUE(contains(stopped("--until", name)["place"], " sent ")) << name;
}

// What was to act after its end is not in the log; up to there the run can be had again.
TEST_F(TracedReplay, ARunThatEndedEarlyComesAsFarAsItsLogKnowsWhatCame) {
  std::string inputs;
  for (int step = 10; step < 4000; step += 10)
    inputs += R"({"id": )" + std::to_string(1000 + step) +
              R"(, "type": "push", "body": 1, "step": )" + std::to_string(step) +
              R"(, "impulse_newton_s": [0, 0, 0.01]})"
              "\n";
  const std::string file = folder_.file("inputs.jsonl");
  write_file(file, inputs);
  const ChildResult ran =
      run_soda({"run", library_file("user-input"), "--steps", "1000000", "--threads", "2",
                "--inputs", file, "--log", log_, "--log-level", "trace"},
               {[] {},
                [](int child) {
                  std::this_thread::sleep_for(std::chrono::milliseconds(300));
                  kill(child, SIGINT);
                }});
  ASSERT_EQ(ran.exit_code, 130) << ran.err;
  const json early = stopped("--until", "30");
  EXPECT_GT(early["happenings"], 1000);
  const ChildResult last = run_soda(
      {"replay", log_, "--until", "happening:" + std::to_string(early["happenings"].get<int>())});
  EXPECT_TRUE(last.exit_code == kExitOk || contains(last.err, "that the log does not hold"))
      << last.err;
}

TEST_F(TracedReplay, ASessionWalksForwardsAndBackwards) {
  run("border-stack", kRuns[0]);
  const ChildResult walked = session("next 3\nback\nnext\nback 99\nn\nquit\nnext\n");
  EXPECT_EQ(walked.exit_code, kExitOk) << walked.err;
  const std::vector<std::string> lines = lines_of(walked.out);
  ASSERT_EQ(lines.size(), 9u)
      << walked.out;  // to before happening 1, and what follows quit is not read
  EXPECT_TRUE(contains(lines[0], "happening 1 of "));
  EXPECT_EQ(lines[3], lines[1]);
  EXPECT_EQ(lines[4], lines[2]);
  EXPECT_EQ(lines[8], lines[0]);
}

TEST_F(TracedReplay, ASessionTellsOfRollbacksWorldsBodiesAndMessages) {
  run("border-stack", kRuns[0]);
  const json found = json::parse(run_soda({"why", log_, "--json", "--rollback", "1"}).out)["found"];
  const std::string message = found[0]["late"][0]["message"];
  const ChildResult told =
      session("rollback\nwhy\nwhy 2\nworld\nworld 1\nbody 100\nbody 100 now\nmessage " + message +
              "\ngoto 20\ngoto world:1:30:pairs\nhelp\nhelp goto\n");
  EXPECT_EQ(told.exit_code, kExitOk) << told.err;
  for (const char* part :
       {" rolls back to step ", "rollback 1 of ", "rollback 2 of ", "messages waiting",
        "committed by now", " has body 100 after step ",
        "and that is late: ", "still to come: happening ", "executed step 20, ",
        "world 1 executed step 30, pairs", "rollback [WORLD[:STEP]]", "an EVENT is one of STEP, "})
    EXPECT_TRUE(contains(told.out, part)) << part << "\n" << told.out;
  const ChildResult refused =
      session("rolback\nb\nback\nwhy\nbody 4711\nworld 77\nmessage 1\nnext x\ngoto nowhere\n");
  EXPECT_EQ(refused.exit_code, kExitInput);
  for (const char* part :
       {"unknown command rolback (did you mean rollback?)", "b may be back or body",
        "the log begins here", "nothing has been rolled back yet", "has no body 4711",
        "world: found 77; allowed: 0 to ", "message: message:1 is no event",
        "how many: found x; allowed: 1 to ", "goto: nowhere is no event"})
    EXPECT_TRUE(contains(refused.err, part)) << part << "\n" << refused.err;
}

TEST_F(TracedReplay, WithoutATraceStepsAndStatesAreWalkedThrough) {
  run("border-stack", {"--steps", "20"}, "commits");
  const ChildResult told = session("goto 7\nbody 100\nback\nnext 99\n");
  EXPECT_EQ(told.exit_code, kExitOk) << told.err;
  LogReader log(log_);
  for (const std::int64_t step : {6, 7, 20})
    EXPECT_TRUE(contains(told.out, "step " + std::to_string(step) + " of 20 is committed, digest " +
                                       format_digest(log.read_step(step).digest)))
        << told.out;
  const ChildResult refused = session("rollback\nworld\n");
  EXPECT_EQ(refused.exit_code, kExitInput);
  EXPECT_TRUE(contains(refused.err, "rollback: " + log_ + " has no trace; soda run --log-level "))
      << refused.err;
  run("border-stack", {"--steps", "20"}, "inputs");
  EXPECT_TRUE(contains(session("body 100\n").err, "has no states"));
}

// The log of a run that went on from a step: the same steps, by the same numbers.
TEST_F(TracedReplay, ARunThatWentOnIsWalkedThroughFromItsFirstStep) {
  const std::string before = folder_.file("before.sodalog");
  ASSERT_EQ(
      run_soda({"run", library_file("border-stack"), "--steps", "70", "--log", before}).exit_code,
      kExitOk);
  const std::vector<std::string> resume = {"run", "--resume", before, "--steps",
                                           "100", "--log",    log_,   "--force"};
  std::vector<std::string> traced = resume;
  traced.insert(traced.end(), {"--log-level", "trace", "--executor", "virtual", "--gating", "off"});
  const ChildResult ran = run_soda(traced);
  ASSERT_EQ(ran.exit_code, kExitOk) << ran.err;
  LogReader log(log_);
  const json stop = stopped("--until", "world:1:80:pairs");
  EXPECT_GT(as_committed(stop, log).first, 0u);
  for (const json& world : stop["worlds"]) {
    EXPECT_LE(world["entries"], 48);
    EXPECT_GE(world["entries"], 0);
  }
  const ChildResult walked = session("body 100\ngoto gvt:75\nbody 100\nworld\n");
  EXPECT_EQ(walked.exit_code, kExitOk) << walked.err;
  ASSERT_EQ(run_soda(resume).exit_code, kExitOk);
  const ChildResult steps = session("goto 70\nnext\nnext 99\n");
  EXPECT_EQ(steps.exit_code, kExitOk) << steps.err;
  for (const std::int64_t step : {70, 71, 100})
    EXPECT_TRUE(contains(steps.out, "step " + std::to_string(step) + " of 100 is committed"))
        << steps.out;
}

// One clock after the other, and each worker's in its order.
TEST_F(TracedReplay, EventsOfALogAreInTheOrderOfTheClock) {
  run("border-stack", kRuns[2]);
  const json events = json::parse(run_soda({"log", log_, "--json", "--lines", "events"}).out);
  std::map<int, std::size_t> workers;
  for (std::size_t i = 1; i < events.size(); ++i) {
    ASSERT_LE(events[i - 1]["clock_s"], events[i]["clock_s"]) << i;
    ++workers[events[i]["worker"]];
  }
  EXPECT_EQ(workers.size(), 4u);
}

TEST_F(TracedReplay, DiffTellsTheFirstEventOfEachWorldThatDiffers) {
  const std::string other = folder_.file("other.sodalog");
  run("border-stack", kRuns[0]);
  write_file(other, read_file(log_));
  const ChildResult same = run_soda({"diff", log_, other});
  EXPECT_TRUE(contains(same.out, "events: the same in all worlds")) << same.out;
  std::vector<std::string> slower = kRuns[0];
  slower[5] = "90";
  run("border-stack", slower);
  const ChildResult told = run_soda({"diff", log_, other});
  EXPECT_EQ(told.exit_code, kExitOk) << told.out;
  EXPECT_TRUE(contains(told.out, "the same bit for bit up to step 90")) << told.out;
  EXPECT_TRUE(contains(told.out, "first event that differs: world ")) << told.out;
  const json events = json::parse(run_soda({"diff", log_, other, "--json"}).out)["events"];
  ASSERT_GT(events.size(), 1u);
  for (std::size_t i = 0; i < events.size(); ++i) {
    EXPECT_NE(events[i]["first"], events[i]["second"]);
    if (i > 0) {
      EXPECT_LE(events[i - 1]["clock_s"], events[i]["clock_s"]);
    }
  }
}

}  // namespace
}  // namespace soda::analysis
