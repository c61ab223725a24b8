// The rules themselves, on small inputs.
#include "tidy/tidy_rules.hpp"

#include <gtest/gtest.h>

namespace soda::tidy {
namespace {

TEST(TidyRules, LayersMayIncludeOnlyWhatTheyAreBuiltOn) {
  EXPECT_TRUE(check_layers({"models/a.cpp", "#include \"physics/model/ids.hpp\"\n"}).empty());
  EXPECT_TRUE(check_layers({"kernel/a.cpp", "#include <vector>\n"}).empty());
  const auto findings =
      check_layers({"kernel/a.cpp", "#include <map>\n#  include \"physics/model/ids.hpp\"\n"});
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].line, 2u);
  EXPECT_EQ(check_layers({"physics/a.cpp", "#include \"kernel/api/executor.hpp\"\n"}).size(), 1u);
  EXPECT_EQ(check_layers({"models/a.cpp", "#include \"scenarios/scenario.hpp\"\n"}).size(), 1u);
  EXPECT_EQ(check_layers({"analysis/a.cpp", "#include \"tests/a.hpp\"\n"}).size(), 1u);
  EXPECT_TRUE(check_layers({"library/src/a.cpp", "#include \"models/run/plan.hpp\"\n"}).empty());
  EXPECT_EQ(check_layers({"library/src/a.cpp", "#include \"analysis/a.hpp\"\n"}).size(), 1u);
  EXPECT_EQ(check_layers({"library/include/soda/a.hpp", "#include \"physics/a.hpp\"\n"}).size(),
            1u);
  EXPECT_EQ(check_layers({"analysis/a.cpp", "#include \"soda/scene.hpp\"\n"}).size(), 1u);
}

TEST(TidyRules, RoomsOfALayerAreAStair) {
  EXPECT_TRUE(check_rooms({"physics/step/a.cpp", "#include \"physics/model/ids.hpp\"\n"}).empty());
  EXPECT_TRUE(check_rooms({"physics/step/a.cpp", "#include \"physics/step/b.hpp\"\n"}).empty());
  EXPECT_TRUE(check_rooms({"models/run/a.cpp", "#include \"physics/step/b.hpp\"\n"}).empty());
  EXPECT_EQ(check_rooms({"physics/model/a.hpp", "#include \"physics/step/b.hpp\"\n"}).size(), 1u);
  EXPECT_EQ(check_rooms({"physics/model/a.hpp", "#include \"physics/b.hpp\"\n"}).size(), 1u);
  EXPECT_EQ(check_rooms({"physics/a.cpp", ""}).size(), 1u);
  EXPECT_EQ(check_rooms({"kernel/api/a.hpp", "#include \"kernel/gvt/gvt.hpp\"\n"}).size(), 1u);
  EXPECT_EQ(check_rooms({"models/a.cpp", ""}).size(), 1u);
}

TEST(TidyRules, HeavyHeadersAreCountedPerLayerAndNeverAllowedInHeaders) {
  const std::string fcl = "#include <fcl/math/bv/OBB.h>\n";
  const std::string json = "#include <nlohmann/json.hpp>\n";
  EXPECT_TRUE(check_heavy_headers({{"physics/a.cpp", fcl}, {"physics/b.cpp", fcl}}).empty());
  EXPECT_EQ(
      check_heavy_headers({{"physics/a.cpp", fcl}, {"physics/b.cpp", fcl}, {"physics/c.cpp", fcl}})
          .size(),
      1u);
  EXPECT_EQ(check_heavy_headers({{"physics/a.hpp", fcl}}).size(), 1u);
  EXPECT_FALSE(check_heavy_headers({{"models/a.cpp", fcl}}).empty());
  EXPECT_TRUE(check_heavy_headers({{"scenarios/a.cpp", json}, {"analysis/a.cpp", json}}).empty());
  EXPECT_EQ(check_heavy_headers({{"analysis/a.cpp", json}, {"analysis/b.cpp", json}}).size(), 1u);
  EXPECT_TRUE(check_heavy_headers({{"analysis/benchmarks/a.cpp", fcl}}).empty());
}

TEST(TidyRules, BannedWordsAreFoundInCodeButNotInCommentsOrLiterals) {
  EXPECT_EQ(check_banned_words({"models/a.cpp", "std::unordered_map<int, int> m;\n"}).size(), 1u);
  EXPECT_TRUE(check_banned_words({"models/a.cpp", "// no unordered_map here\n"}).empty());
  EXPECT_TRUE(check_banned_words({"models/a.cpp", "f(\"unordered_map\");\n"}).empty());
  EXPECT_TRUE(check_banned_words({"analysis/a.cpp", "std::unordered_map<int, int> m;\n"}).empty());
  EXPECT_EQ(check_banned_words({"physics/a.cpp", "x = std::cos(a);\n"}).size(), 1u);
  EXPECT_TRUE(check_banned_words({"physics/a.cpp", "x = std::sqrt(a);\n"}).empty());
  EXPECT_EQ(check_banned_words({"kernel/a.cpp", "int r = std::rand();\n"}).size(), 1u);
  EXPECT_EQ(check_banned_words({"kernel/a.cpp", "thread_local int x;\n"}).size(), 1u);
}

TEST(TidyRules, OnlyAnAbortMayPrintInSpeculativeLayers) {
  const std::string print = "std::fprintf(stderr, \"x\");\n";
  EXPECT_TRUE(check_banned_words({"kernel/a.cpp", print + "std::abort();\n"}).empty());
  EXPECT_EQ(check_banned_words({"kernel/a.cpp", print + "return;\n"}).size(), 1u);
  EXPECT_EQ(check_banned_words({"models/a.cpp", "std::printf(\"x\");\n"}).size(), 1u);
  EXPECT_TRUE(check_banned_words({"analysis/a.cpp", print}).empty());
}

TEST(TidyRules, FlagsThatChangeBitsAndWrongTermsAreFoundInAnyText) {
  EXPECT_EQ(check_banned_words({"CMakeLists.txt", "add_compile_options(-march=native)\n"}).size(),
            1u);
  EXPECT_EQ(check_banned_words({"README.md", "With Lookahead\n"}).size(), 1u);
  EXPECT_TRUE(check_banned_words({"README.md", "With anticipation\n"}).empty());
}

TEST(TidyRules, ThePholdOptionIsTheOnlyUseOfItsWord) {
  for (const char* fine : {"add_option(\"--lookahead\", x)\n", "soda phold --lookahead 0.5\n",
                           "the option `--lookahead`\n", "--lookahead\n"})
    EXPECT_TRUE(check_banned_words({"analysis/a.cpp", fine}).empty()) << fine;
  for (const char* wrong : {"--lookaheads\n", "-lookahead\n", "x--lookahead;\n", "--Lookahead\n",
                            "--lookahead is the lookahead\n", "---lookahead\n"})
    EXPECT_EQ(check_banned_words({"analysis/a.cpp", wrong}).size(), 1u) << wrong;
}

TEST(TidyRules, LinesAreMeasuredInCharacters) {
  EXPECT_TRUE(check_lines({"a.cpp", std::string(100, 'x') + "\n"}).empty());
  EXPECT_EQ(check_lines({"a.cpp", std::string(101, 'x') + "\n"}).size(), 1u);
  EXPECT_TRUE(check_lines({"a.cpp", std::string(99, 'x') + "\xc3\xa9\n"}).empty());
  EXPECT_EQ(check_lines({"a.cpp", "int a; \n"}).size(), 1u);
  EXPECT_EQ(check_lines({"a.cpp", "\tint a;\n"}).size(), 1u);
  EXPECT_EQ(check_lines({"a.cpp", "int a;"}).size(), 1u);
}

TEST(TidyRules, FilesAreMeasuredInLines) {
  std::string text;
  for (int i = 0; i < 400; ++i) text += "x\n";
  EXPECT_TRUE(check_file_length({"a.cpp", text}).empty());
  EXPECT_EQ(check_file_length({"a.cpp", text + "x\n"}).size(), 1u);
}

TEST(TidyRules, FunctionsAreMeasuredInNamespacesAndClassesButNotTypesOrInitialisers) {
  const std::string text =
      "namespace a {\n"               // 1
      "struct S {\n"                  // 2
      "  int x{1};\n"                 // 3
      "  int f() const {\n"           // 4
      "    return x;\n"               // 5
      "  }\n"                         // 6
      "};\n"                          // 7
      "const int v[] = {1,\n"         // 8
      "  2};\n"                       // 9
      "void g(int a) {\n"             // 10
      "  if (a) {\n"                  // 11
      "    h([] { return '}'; });\n"  // 12
      "  }\n"                         // 13
      "}  // g\n"                     // 14
      "}\n";
  const auto sizes = function_sizes({"a.cpp", text});
  ASSERT_EQ(sizes.size(), 2u);
  EXPECT_EQ(sizes[0].line, 4u);
  EXPECT_EQ(sizes[0].lines, 3u);
  EXPECT_EQ(sizes[1].line, 10u);
  EXPECT_EQ(sizes[1].lines, 5u);
  EXPECT_EQ(check_function_length({"a.cpp", text}, 4).size(), 1u);
  EXPECT_TRUE(check_function_length({"a.cpp", text}, 5).empty());
}

TEST(TidyRules, ParametersAreCountedButNotCommasInsideThem) {
  const std::string text =
      "template <class T, class U>\n"
      "void f(std::map<int, int> a, T (&b)[2], U c = g(1, 2)) {\n"
      "}\n"
      "void h() {\n"
      "  f(1, 2, 3, 4);\n"
      "}\n";
  const auto sizes = function_sizes({"a.cpp", text});
  ASSERT_EQ(sizes.size(), 2u);
  EXPECT_EQ(sizes[0].parameters, 3u);
  EXPECT_EQ(sizes[1].parameters, 0u);
  EXPECT_EQ(check_parameters({"a.cpp", text}, 2).size(), 1u);
  EXPECT_TRUE(check_parameters({"a.cpp", text}, 3).empty());
}

TEST(TidyRules, LeftoversAreFoundAsWholeWords) {
  EXPECT_EQ(check_leftovers({"a.cpp", std::string("// TO") + "DO later\n"}).size(), 1u);
  EXPECT_TRUE(check_leftovers({"a.cpp", "// mastodon\n"}).empty());
}

TEST(TidyRules, ReadmesMustNameEveryHeader) {
  EXPECT_TRUE(check_readme({"kernel/README.md", "- gvt.hpp: the cut"}, {"gvt.hpp"}).empty());
  EXPECT_EQ(check_readme({"kernel/README.md", "nothing"}, {"gvt.hpp", "worker.hpp"}).size(), 2u);
}

TEST(TidyRules, CommentsAndLiteralsAreBlankedWithTheirLinesKept) {
  EXPECT_EQ(without_comments_and_literals("a // b\nc"), "a     \nc");
  EXPECT_EQ(without_comments_and_literals("a /* b\n */ c"), "a     \n    c");
  EXPECT_EQ(without_comments_and_literals("f(\"a\\\"}\");"), "f(      );");
  EXPECT_EQ(without_comments_and_literals("x = 1'000;"), "x = 1'000;");
  EXPECT_EQ(without_comments_and_literals("R\"(a\"b)\" c"), "         c");
}

}  // namespace
}  // namespace soda::tidy
