// `soda diff`: through the binary, and how far apart numbers are.
#include "analysis/commands/diff_command.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "analysis/child_process.hpp"
#include "analysis/forged_log.hpp"
#include "analysis/text/exit_codes.hpp"

namespace soda::analysis {
namespace {

using analysis_test::ChildResult;
using analysis_test::contains;
using analysis_test::library_file;
using analysis_test::run_soda;
using analysis_test::TemporaryFolder;
using nlohmann::json;

class Diff : public testing::Test {
 protected:
  std::string log_of(const std::string& name, std::vector<std::string> options) const {
    const std::string log = folder_.file(name);
    std::vector<std::string> command = {"run", library_file("border-stack"), "--log", log};
    command.insert(command.end(), options.begin(), options.end());
    EXPECT_EQ(run_soda(command).exit_code, kExitOk);
    return log;
  }

  // The log with one step changed, sound by its checksums.
  std::string with_step(const std::string& log, std::int64_t changed, auto change) const {
    const std::string file = folder_.file("changed.sodalog");
    analysis_test::rewrite_log(log, file, [&](LoggedStep& step) {
      if (step.step == changed) change(step);
    });
    return file;
  }

  const TemporaryFolder folder_;
};

TEST_F(Diff, RunsWithOtherOptionsAreTheSameBitForBit) {
  const std::string a = log_of("a.sodalog", {"--steps", "30"});
  const std::string b =
      log_of("b.sodalog", {"--steps", "40", "--threads", "2", "--gating", "off", "--buffer", "3"});
  const ChildResult told = run_soda({"diff", a, b});
  EXPECT_EQ(told.exit_code, kExitOk) << told.err;
  for (const char* part : {"gating", " off\n", "buffer", "threads", "steps: 30 and 40",
                           "the same bit for bit up to step 30"})
    EXPECT_TRUE(contains(told.out, part)) << part << "\n" << told.out;
  EXPECT_FALSE(contains(told.out, "scenario"));
}

TEST_F(Diff, TheFirstFieldThatDiffersIsToldWithItsUlps) {
  const std::string a = log_of("a.sodalog", {"--steps", "30"});
  const std::string b = with_step(a, 17, [](LoggedStep& step) {
    double& z = step.states[3].position_m.z();
    z = std::nextafter(std::nextafter(z, 100.0), 100.0);
  });
  const ChildResult told = run_soda({"diff", a, b});
  EXPECT_EQ(told.exit_code, kExitCheckFailed);
  EXPECT_TRUE(contains(told.out, "first difference: step 17, body ")) << told.out;
  EXPECT_TRUE(contains(told.out, "position_m.z")) << told.out;
  EXPECT_TRUE(contains(told.out, "2 ulps apart")) << told.out;
  const json found = json::parse(run_soda({"diff", a, b, "--json"}).out);
  EXPECT_EQ(found["equal_steps"], 17);
  EXPECT_EQ(found["difference"]["step"], 17);
  EXPECT_EQ(found["difference"]["what"], "position_m.z");
  EXPECT_EQ(found["difference"]["ulps"], 2);
  EXPECT_NE(found["difference"]["first_bits"], found["difference"]["second_bits"]);
}

TEST_F(Diff, InputsAndBodiesThatAreNotThereAreTold) {
  const std::string a = log_of("a.sodalog", {"--steps", "10"});
  const std::string fewer = with_step(a, 4, [](LoggedStep& step) {
    step.ids.pop_back();
    step.states.pop_back();
  });
  EXPECT_TRUE(contains(run_soda({"diff", a, fewer}).out, "first difference: step 4, bodies"));
  const std::string pushed = with_step(a, 6, [](LoggedStep& step) {
    models::CommittedInput input;
    input.input.step = 5;
    input.input.kind = models::InputKind::kPush;
    step.inputs.push_back(input);
  });
  EXPECT_TRUE(contains(run_soda({"diff", a, pushed}).out, "first difference: step 6, inputs"));
}

TEST_F(Diff, AnotherScenarioIsNamedWithItsLine) {
  const std::string a = log_of("a.sodalog", {"--steps", "3"});
  const std::string b = folder_.file("b.sodalog");
  ASSERT_EQ(run_soda({"run", library_file("crowd"), "--steps", "3", "--log", b}).exit_code,
            kExitOk);
  const ChildResult told = run_soda({"diff", a, b});
  EXPECT_EQ(told.exit_code, kExitCheckFailed);
  EXPECT_TRUE(contains(told.out, "border-stack.json, line 4 differs")) << told.out;
  EXPECT_TRUE(contains(told.out, "first difference: step 0, bodies")) << told.out;
}

TEST(Ulps, CountNumbersFromOneToTheOther) {
  EXPECT_EQ(ulps_between(1.0, 1.0), 0u);
  EXPECT_EQ(ulps_between(1.0, std::nextafter(1.0, 2.0)), 1u);
  EXPECT_EQ(ulps_between(0.0, -0.0), 1u);
  const double least = std::numeric_limits<double>::denorm_min();
  EXPECT_EQ(ulps_between(-least, least), 3u);
  EXPECT_EQ(ulps_between(-1.0, std::nextafter(-1.0, -2.0)), 1u);
  EXPECT_FALSE(ulps_between(1.0, std::nan("")).has_value());
}

}  // namespace
}  // namespace soda::analysis
