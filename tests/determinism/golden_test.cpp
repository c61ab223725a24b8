// Stored digests of whole runs: the bits must not depend on optimisation, on the compiler, on the
// processor's libm variants, or on the day.

#include <gtest/gtest.h>

#include "tests/determinism/golden_runs.hpp"

namespace soda::test {
namespace {

class GoldenDigests : public testing::TestWithParam<GoldenRun> {};

TEST_P(GoldenDigests, EveryStepOfTheWholeRunIsAsStored) {
  EXPECT_EQ(golden_run(GetParam().scene), GetParam());
}

INSTANTIATE_TEST_SUITE_P(Scenes, GoldenDigests, testing::ValuesIn(stored_runs()),
                         [](const auto& info) { return test_name(info.param); });

TEST(GoldenDigest, EveryLibraryAndCaseSceneHasOne) {
  std::vector<std::string> stored;
  for (const GoldenRun& run : stored_runs()) stored.push_back(run.scene);
  EXPECT_EQ(stored, golden_scenes());
}

}  // namespace
}  // namespace soda::test
