// `soda groups` through the binary.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

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
using nlohmann::json;

double sum_of_shares(const json& shares) {
  double sum = 0.0;
  for (const auto& [name, share] : shares.items())
    sum += share.is_object() ? share["mean"].get<double>() : share.get<double>();
  return sum;
}

TEST(GroupsCommand, SweepsBodiesAndWorldsAndSaysTheSameTwice) {
  const std::vector<std::string> command = {"groups", "--bodies", "50,500",  "--worlds", "12,24",
                                            "--by",   "all",      "--seeds", "1..3",     "--json"};
  const ChildResult first = run_soda(command), second = run_soda(command);
  ASSERT_EQ(first.exit_code, kExitOk) << first.err;
  EXPECT_EQ(first.out, second.out);
  EXPECT_EQ(first.err, "");
  const json points = json::parse(first.out)["points"];
  EXPECT_EQ(points.size(), 2u * 2u * 2u * 2u);
  for (const json& point : points) EXPECT_NEAR(sum_of_shares(point["shares"]), 1.0, 1e-12);
}

TEST(GroupsCommand, ChecksThePresetsAgainstKnownFigures) {
  for (const auto& [preset, rows] : {std::pair{"paper-fig6", 12u}, {"paper-fig7", 8u}}) {
    const ChildResult checked =
        run_soda({"groups", "--preset", preset, "--seeds", "1..2", "--check", "--json"});
    const json points = json::parse(checked.out)["points"];
    ASSERT_EQ(points.size(), rows);
    bool off = false;
    for (const json& point : points) {
      EXPECT_FALSE(point["known"].is_null());
      off = off || point["points_off"] > 5.0;
    }
    EXPECT_EQ(checked.exit_code, off ? kExitCheckFailed : kExitOk);
  }
}

TEST(GroupsCommand, FollowsARunStepByStep) {
  const ChildResult ran =
      run_soda({"groups", library_file("five-worlds-chain"), "--steps", "40", "--json"});
  ASSERT_EQ(ran.exit_code, kExitOk) << ran.err;
  const json report = json::parse(ran.out);
  ASSERT_EQ(report["bonds"].size(), 3u);
  std::map<std::string, double> alone;
  for (const json& bond : report["bonds"]) {
    ASSERT_EQ(bond["steps"].size(), 40u);
    for (const json& step : bond["steps"]) {
      EXPECT_NEAR(sum_of_shares(step["shares"]), 1.0, 1e-12);
      alone[bond["by"]] += step["shares"]["1"].get<double>() / 40;
    }
  }
  // One island lies across all five worlds.
  EXPECT_EQ(alone["contact"], 0.0);
  EXPECT_EQ(alone["overlap"], 0.0);
  EXPECT_LT(alone["rollbacks"], 1.0);
}

TEST(GroupsCommand, OneWorldIsAlwaysAlone) {
  const ChildResult ran = run_soda({"groups", library_file("third-world"), "--steps", "20",
                                    "--worlds", "1", "--csv", "--by", "overlap,contact"});
  ASSERT_EQ(ran.exit_code, kExitOk) << ran.err;
  EXPECT_TRUE(ran.out.starts_with("by,step,1,2-4,5-8,9+,largest\noverlap,0,1,0,0,0,1\n"))
      << ran.out;
}

TEST(GroupsCommand, WritesAPageWithDiagramsAndNeverOverAnother) {
  const TemporaryFolder folder;
  const std::vector<std::string> command = {
      "groups", "--bodies", "50,500", "--seeds", "1..2", "-o", folder.file("a.html")};
  ASSERT_EQ(run_soda(command).exit_code, kExitOk);
  const std::string page = read_file(folder.file("a.html"));
  EXPECT_TRUE(contains(page, "<svg")) << page.substr(0, 400);
  EXPECT_TRUE(contains(page, "threshold (law)"));
  EXPECT_TRUE(contains(page, "<code>soda groups --bodies 50,500 --seeds 1..2 -o " +
                                 folder.file("a.html") + "</code>"));
  EXPECT_EQ(run_soda(command).exit_code, kExitFile);
  EXPECT_EQ(folder.files().size(), 1u);
}

TEST(GroupsCommand, RefusesWhatDoesNotGoTogether) {
  const std::string file = library_file("third-world");
  const std::vector<std::pair<std::vector<std::string>, std::string>> wrong = {
      {{"--by", "rollbacks"}, "--by rollbacks: nothing runs without a FILE"},
      {{"--by", "touch"}, "touch"},
      {{"--bodies", "0"}, "--bodies: found 0; allowed: 1 to 100000"},
      {{"--worlds", "0"}, "--worlds: found 0; allowed: 1 to 2000"},
      {{"--preset", "paper-fig6", "--bodies", "5"}, "--preset"},
      {{"--preset", "threshold", "--check"}, "--check"},
      {{"--seeds", "3..1"}, "--seeds: found 3..1"},
      {{file, "--bodies", "5"}, "--bodies"},
      {{file, "--worlds", "1,2"}, "--worlds: one number"},
      {{"--steps", "5"}, "--steps: needs a FILE"},
  };
  for (const auto& [options, message] : wrong) {
    std::vector<std::string> command = {"groups"};
    command.insert(command.end(), options.begin(), options.end());
    const ChildResult refused = run_soda(command);
    EXPECT_EQ(refused.exit_code, kExitInput) << message;
    EXPECT_TRUE(contains(refused.err, message)) << refused.err;
    EXPECT_EQ(refused.out, "");
  }
}

}  // namespace
}  // namespace soda::analysis
