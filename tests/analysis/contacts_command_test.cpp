// `soda contacts`: through the binary.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "analysis/child_process.hpp"
#include "analysis/text/exit_codes.hpp"

namespace soda::analysis {
namespace {

using analysis_test::contains;
using analysis_test::run_soda;
using analysis_test::TemporaryFolder;
using analysis_test::write_file;

// Two boxes of 2 kg on each other, on a static with a comma in its name.
constexpr const char* kStack = R"({"format": 1, "gravity_m_s2": [0, 0, -10], "time_step_s": 0.01,
"steps": 100, "materials": [{"name": "m", "friction": 0.5, "restitution": 0}],
"statics": [{"name": "floor, wide", "shape": {"type": "halfspace"}, "material": "m"}],
"bodies": [{"id": 5, "shape": {"type": "box", "size_m": [1, 1, 1]}, "mass_kg": 2, "material": "m",
 "position_m": [0, 0, 0.5]},
 {"id": 9, "shape": {"type": "box", "size_m": [1, 1, 1]}, "mass_kg": 2, "material": "m",
 "position_m": [0, 0, 1.5]}]})";

std::string log_of_stack(const TemporaryFolder& folder) {
  const std::string scene = folder.file("stack.json"), log = folder.file("stack.sodalog");
  write_file(scene, kStack);
  EXPECT_EQ(run_soda({"run", scene, "--log", log}).exit_code, kExitOk);
  return log;
}

TEST(ContactsCommand, TellsTheForcesOfAStackInAllForms) {
  const TemporaryFolder folder;
  const std::string log = log_of_stack(folder);
  const auto table = run_soda({"contacts", log});
  EXPECT_EQ(table.exit_code, kExitOk);
  EXPECT_TRUE(contains(table.out, "step 100: 8 contact points")) << table.out;
  const auto json = nlohmann::json::parse(run_soda({"contacts", log, "--json"}).out);
  ASSERT_EQ(json["steps"].size(), 1u);
  double on_floor = 0.0, between = 0.0;
  for (const auto& contact : json["steps"][0]["contacts"])
    (contact.contains("static") ? on_floor : between) += contact["normal_newton"].get<double>();
  EXPECT_NEAR(on_floor, 40.0, 1e-4);
  EXPECT_NEAR(between, 20.0, 1e-4);
  const auto csv = run_soda({"contacts", log, "--every", "50", "--csv", "--body", "9"});
  EXPECT_EQ(csv.out.rfind("step,body,other,x_m", 0), 0u) << csv.out;
  EXPECT_TRUE(contains(csv.out, "\n50,5,9,")) << csv.out;
  EXPECT_FALSE(contains(csv.out, "floor")) << csv.out;
  EXPECT_TRUE(contains(run_soda({"contacts", log, "--csv"}).out, "100,5,\"floor, wide\","));
}

TEST(ContactsCommand, RefusesStepsAndBodiesThatAreNotThere) {
  const TemporaryFolder folder;
  const std::string log = log_of_stack(folder);
  const auto step = run_soda({"contacts", log, "--step", "101"});
  EXPECT_EQ(step.exit_code, kExitInput);
  EXPECT_TRUE(contains(step.err, "--step: found 101; allowed: 0 to 100")) << step.err;
  const auto body = run_soda({"contacts", log, "--body", "6"});
  EXPECT_EQ(body.exit_code, kExitInput);
  EXPECT_TRUE(contains(body.err, "has no body 6")) << body.err;
}

}  // namespace
}  // namespace soda::analysis
