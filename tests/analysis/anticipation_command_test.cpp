// `soda anticipation` through the binary.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "analysis/child_process.hpp"
#include "analysis/text/exit_codes.hpp"

namespace soda::analysis {
namespace {

using analysis_test::ChildResult;
using analysis_test::contains;
using analysis_test::library_file;
using analysis_test::read_file;
using analysis_test::run_soda;
using analysis_test::TemporaryFolder;
using Json = nlohmann::json;

TEST(AnticipationCommand, ReportsEveryPointAndDrawsIt) {
  const TemporaryFolder folder;
  const std::string page = folder.file("fig8.html");
  const std::vector<std::string> command = {
      "anticipation", "--buffers", "2,4",    "--overloads", "0,0.5", "--utilisation", "0.8",
      "--max-steps",  "40",        "--json", "-o",          page,    "--force"};
  const ChildResult result = run_soda(command);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json json = Json::parse(result.out);
  ASSERT_EQ(json["points"].size(), 8u) << "the law and the model of each";
  const Json& last = json["points"][7];
  EXPECT_EQ(last["buffer"], 4);
  EXPECT_EQ(last["overload"], 0.5);
  EXPECT_EQ(last["mode"], "modelled");
  EXPECT_EQ(last["steps_until_late"], json["points"][6]["steps_until_late"]);
  EXPECT_TRUE(contains(read_file(page), "<polyline"));
  EXPECT_TRUE(
      contains(read_file(page), "<code>soda anticipation --buffers 2,4 --overloads 0,0.5 "));
  EXPECT_EQ(run_soda(command).out, result.out) << "the model is the same twice";
}

TEST(AnticipationCommand, OverMakespanNamesTheKnee) {
  const ChildResult result = run_soda({"anticipation", library_file("border-stack"), "--over",
                                       "makespan", "--buffers", "1,2,8", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json json = Json::parse(result.out);
  ASSERT_EQ(json["points"].size(), 3u);
  double best = 1e9, at_knee = 0.0;
  for (const Json& point : json["points"]) {
    best = std::min(best, point["makespan_s"].get<double>());
    if (point["buffer"] == json["knee"]) at_knee = point["makespan_s"];
  }
  EXPECT_GT(at_knee, 0.0);
  EXPECT_LE(at_knee, 1.02 * best);
}

TEST(AnticipationCommand, OverMakespanOfFewSteps) {
  const auto makespan_s = [](const char* steps) {
    const ChildResult result = run_soda({"anticipation", library_file("crowd"), "--over",
                                         "makespan", "--buffers", "2", "--steps", steps, "--json"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return Json::parse(result.out)["points"][0]["makespan_s"].get<double>();
  };
  const double short_s = makespan_s("10"), longer_s = makespan_s("20");
  EXPECT_GT(short_s, 0.0);
  EXPECT_GT(longer_s, 1.5 * short_s);
  EXPECT_LT(longer_s, 3.0 * short_s);
}

TEST(AnticipationCommand, RunsAScenarioWithAPeakOfSomeWorlds) {
  const ChildResult result =
      run_soda({"anticipation", library_file("border-stack"), "--buffers", "4", "--overloads", "1",
                "--peak", "1@0.2+0.3", "--max-steps", "60", "--csv"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(contains(result.out, "buffer,overload,mode,")) << result.out;
  EXPECT_TRUE(contains(result.out, "\n4,1,modelled,")) << result.out;
  const ChildResult refused =
      run_soda({"anticipation", library_file("border-stack"), "--peak", "9@1"});
  EXPECT_EQ(refused.exit_code, kExitInput);
  EXPECT_TRUE(contains(refused.err, "allowed: 0 to")) << refused.err;
}

}  // namespace
}  // namespace soda::analysis
