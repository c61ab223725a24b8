// Every library and case scene as a user runs it: the built program, default options, all steps.
#include <gtest/gtest.h>

#include <iomanip>
#include <nlohmann/json.hpp>
#include <sstream>

#include "analysis/child_process.hpp"
#include "tests/determinism/golden_runs.hpp"

namespace soda::test {
namespace {

using analysis_test::ChildResult;
using analysis_test::run_soda;

class FullLength : public testing::TestWithParam<GoldenRun> {};

TEST_P(FullLength, EndsWithExitCodeZeroAndTheStoredDigest) {
  const ChildResult run = run_soda({"run", scene_file(GetParam().scene), "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  std::istringstream told(run.err);
  for (std::string line; std::getline(told, line);)
    EXPECT_TRUE(analysis_test::contains(line, ": warning ")) << line;
  const nlohmann::json report = nlohmann::json::parse(run.out);
  std::ostringstream last;
  last << std::hex << std::setw(16) << std::setfill('0') << GetParam().last;
  EXPECT_EQ(report.at("digest"), last.str());
}

INSTANTIATE_TEST_SUITE_P(Scenes, FullLength, testing::ValuesIn(stored_runs()),
                         [](const auto& info) { return test_name(info.param); });

}  // namespace
}  // namespace soda::test
