// `soda fuzz` and `soda accuracy --extremes` through the binary.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "analysis/child_process.hpp"

namespace soda::analysis {
namespace {

using analysis_test::ChildResult;
using analysis_test::contains;
using analysis_test::run_soda;
using analysis_test::TemporaryFolder;
using Json = nlohmann::json;

TEST(FuzzCommand, PrintsOneJsonObjectWithEveryDocumentedKey) {
  const ChildResult result = run_soda({"fuzz", "--seeds", "1..20", "--steps", "10", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  const Json json = Json::parse(result.out);
  EXPECT_EQ(json["trials"], 20);
  EXPECT_EQ(json["steps"], 200);
  for (const char* key :
       {"out_of_time", "wall_s", "islands", "contact_points", "most_iterations",
        "most_multiplications", "largest_gain_rel", "push_out_work_joule", "failures"})
    EXPECT_TRUE(json.contains(key)) << key;
}

// A force gives a ball kinetic energy, which no check expects.
TEST(FuzzCommand, AFileThatFailsExitsWith1AndIsNamed) {
  const TemporaryFolder folder;
  const std::string file = folder.file("pushed.json");
  std::ofstream(file) << R"({
    "format": 1, "gravity_m_s2": [0, 0, 0], "time_step_s": 0.01, "steps": 5,
    "materials": [{"name": "stuff", "friction": 0, "restitution": 0}],
    "bodies": [{"id": 7, "shape": {"type": "sphere", "radius_m": 0.1}, "mass_kg": 1,
                "material": "stuff", "position_m": [1, 0, 0], "force_newton": [10, 0, 0]}]})";
  const ChildResult result = run_soda({"fuzz", file});
  EXPECT_EQ(result.exit_code, 1) << result.out;
  EXPECT_TRUE(contains(result.out, "FAILED: " + file)) << result.out;
  EXPECT_TRUE(contains(result.out, "step 1, body 7: energy")) << result.out;
}

TEST(FuzzCommand, WhatCannotBeAskedForExitsWith2AndWhatCannotBeReadWith3) {
  EXPECT_EQ(run_soda({"fuzz", "--seeds", "3..1"}).exit_code, 2);
  EXPECT_EQ(run_soda({"fuzz", "--steps", "0"}).exit_code, 2);
  EXPECT_EQ(run_soda({"fuzz", "--joints", "--springs"}).exit_code, 2);
  EXPECT_EQ(run_soda({"fuzz", "/no/such/file.json"}).exit_code, 3);
  EXPECT_EQ(run_soda({"accuracy", "--extremes", "bounce"}).exit_code, 2);
}

}  // namespace
}  // namespace soda::analysis
