// Code that is not optimised has the stored bits, too: the first steps of every scene. Whole runs
// of it take an hour and a half: golden_test of the debug preset (tests/README.md).
#include <gtest/gtest.h>

#include "tests/determinism/golden_runs.hpp"

namespace soda::test {
namespace {

class GoldenFirstSteps : public testing::TestWithParam<GoldenRun> {};

TEST_P(GoldenFirstSteps, AreAsStored) {
  EXPECT_EQ(digest_of_first_steps(GetParam().scene, GetParam().first_steps),
            GetParam().first_digest);
}

INSTANTIATE_TEST_SUITE_P(Scenes, GoldenFirstSteps, testing::ValuesIn(stored_runs()),
                         [](const auto& info) { return test_name(info.param); });

}  // namespace
}  // namespace soda::test
