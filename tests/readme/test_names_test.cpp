// Commands of pages that run tests select tests that there are: GoogleTest and ctest succeed where
// a filter selects nothing.
#include "tests/readme/test_names.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

namespace soda::readme {
namespace {

namespace fs = std::filesystem;
using Strings = std::vector<std::string>;

std::string content_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void append(const Strings& more, Strings& all) { all.insert(all.end(), more.begin(), more.end()); }

Strings tests_of_repository() {
  Strings tests;
  for (const auto& entry : fs::recursive_directory_iterator(fs::path(SODA_SOURCE_DIR) / "tests")) {
    const fs::path& path = entry.path();
    if (path.extension() == ".cpp") append(tests_of_source(content_of(path)), tests);
    if (path.filename() == "CMakeLists.txt") append(tests_of_cmake(content_of(path)), tests);
  }
  return tests;
}

TEST(TestNames, ThatPagesTellToRunAreThere) {
  const Strings tests = tests_of_repository();
  EXPECT_GE(tests.size(), 1000u);
  std::size_t selected = 0;
  const fs::path root = SODA_SOURCE_DIR;
  for (auto it = fs::recursive_directory_iterator(root); it != fs::end(it); ++it) {
    const std::string name = it->path().filename().string();
    if (it->is_directory() && (name == "build" || name.starts_with('.')))
      it.disable_recursion_pending();
    if (!it->is_regular_file() || it->path().extension() != ".md") continue;
    for (const TestSelection& selection : test_selections_of(content_of(it->path()))) {
      ++selected;
      EXPECT_TRUE(selects_any(selection, tests))
          << fs::relative(it->path(), root).string() << ":" << selection.line << ": "
          << selection.pattern << " selects no test";
    }
  }
  EXPECT_GE(selected, 80u);
}

TEST(TestNames, AreSelectedByFiltersAndByExpressionsOfCtest) {
  const std::vector<TestSelection> found = test_selections_of(
      "Run `units_test\n--gtest_filter='A.*:B.Does*-C.*'` or\n\n"
      "    units_test --gtest_filter=D.*\n    ctest --test-dir b -R 'E|F'\n\n`ctest -R G` -R H\n");
  ASSERT_EQ(found.size(), 5u);
  EXPECT_EQ(found[0].pattern, "A.*");
  EXPECT_EQ(found[0].line, 2u);
  EXPECT_EQ(found[1].pattern, "B.Does*");
  EXPECT_EQ(found[2].pattern, "D.*");
  EXPECT_FALSE(found[2].is_of_ctest);
  EXPECT_EQ(found[3].pattern, "E|F");
  EXPECT_EQ(found[3].line, 5u);
  EXPECT_EQ(found[4].pattern, "G");
  EXPECT_TRUE(found[4].is_of_ctest);
}

TEST(TestNames, OfSourcesAndOfCMakeHaveAStarForWhatIsKnownLater) {
  EXPECT_EQ(tests_of_source("TEST(A, Does) {\nTEST_F(B, Is) {\n// TEST(C, No)\nTEST_P(D, Has) {\n"
                            "INSTANTIATE_TEST_SUITE_P(All, D, kAll);\nTEST_P(E, IsNever) {\n"),
            (Strings{"A.Does", "B.Is", "All/D.Has/*"}));
  EXPECT_EQ(tests_of_cmake("add_test(NAME E.${x}.F COMMAND e)\nadd_test(NAME G\n  COMMAND g)\n"
                           "add_test(NAME ${h} COMMAND h)\n"),
            (Strings{"E.*.F", "G"}));
}

TEST(TestNames, OfTestsWithParametersBeginWithAPrefix) {
  const Strings tests = {"A.Does", "All/D.Has/*"};
  EXPECT_TRUE(selects_any({1, "A.*", false}, tests));
  EXPECT_TRUE(selects_any({1, "A.Doe?", false}, tests));
  EXPECT_FALSE(selects_any({1, "A.Do", false}, tests));
  EXPECT_TRUE(selects_any({1, "*D.*", false}, tests));
  EXPECT_FALSE(selects_any({1, "D.*", false}, tests));
  EXPECT_TRUE(selects_any({1, "D.H", true}, tests));
  EXPECT_FALSE(selects_any({1, "d", true}, {"A.Does"}));
}

}  // namespace
}  // namespace soda::readme
