// `soda accuracy --families` through the binary.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "analysis/child_process.hpp"

namespace soda::analysis {
namespace {

using analysis_test::ChildResult;
using analysis_test::contains;
using analysis_test::read_file;
using analysis_test::run_soda;
using analysis_test::TemporaryFolder;
using Json = nlohmann::json;

TEST(FamiliesCommand, PrintsOneJsonObjectWithEveryDocumentedKeyAndDrawsPictures) {
  const TemporaryFolder folder;
  const std::string page = folder.file("families.html");
  const ChildResult result = run_soda(
      {"accuracy", "--families", "stack", "--json", "--check", "--repeat", "1", "-o", page});
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  const Json json = Json::parse(result.out);
  EXPECT_EQ(json["missed"], 0);
  EXPECT_EQ(json["jump"], 2.0);
  EXPECT_EQ(json["least_work"], 1000.0);
  const Json& family = json["families"][0];
  EXPECT_EQ(family["family"], "stack");
  for (const char* key : {"name", "meaning", "bound", "floor", "floor_reason"})
    EXPECT_TRUE(family["measures"][0].contains(key)) << key;
  const Json& series = family["series"][0];
  for (const char* key : {"series", "runs", "misses", "left_out"})
    EXPECT_TRUE(series.contains(key)) << key;
  for (const char* key : {"n", "bodies", "steps", "errors", "fault", "cpu_us", "work", "impacts",
                          "row_sweeps", "multiplications"})
    EXPECT_TRUE(series["runs"][0].contains(key)) << key;
  EXPECT_GT(series["runs"][0]["cpu_us"], 0.0);
  EXPECT_TRUE(contains(read_file(page), "<svg"));
  EXPECT_TRUE(contains(read_file(page), "<code>soda accuracy --families stack --json --check "));
}

TEST(FamiliesCommand, WhatCannotBeAskedForExitsWith2) {
  const ChildResult result = run_soda({"accuracy", "--families", "stak"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_TRUE(contains(result.err, "no family stak (did you mean stack?)")) << result.err;
  EXPECT_EQ(run_soda({"accuracy", "--full", "bounce"}).exit_code, 2);
  EXPECT_EQ(run_soda({"accuracy", "--families", "--extremes"}).exit_code, 2);
}

}  // namespace
}  // namespace soda::analysis
