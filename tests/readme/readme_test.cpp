// What READMEs and docs quote is what the program prints. With SODA_REWRITE_READMES=1 they are
// mended where it is not (tests/readme/rewrite.sh).
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>

#include "tests/analysis/child_process.hpp"
#include "tests/readme/quoted_blocks.hpp"

namespace soda::readme {
namespace {

namespace fs = std::filesystem;
using analysis_test::TemporaryFolder;

const fs::path kSources = SODA_SOURCE_DIR;

std::string text_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

// READMEs of the layers and of tests, and all pages of docs.
std::vector<fs::path> pages() {
  std::vector<fs::path> found = {kSources / "README.md"};
  for (const char* folder :
       {"kernel", "physics", "models", "scenarios", "analysis", "tests", "docs"})
    for (const auto& entry : fs::recursive_directory_iterator(kSources / folder)) {
      const bool all = std::string_view(folder) == "docs";
      if (all ? entry.path().extension() == ".md" : entry.path().filename() == "README.md")
        found.push_back(entry.path());
    }
  std::sort(found.begin() + 1, found.end());
  return found;
}

// A folder that looks like that of the sources, and takes what a command writes.
class Desk {
 public:
  Desk() {
    for (const char* name : {"scenarios", "analysis", "tests"})
      fs::create_directory_symlink(kSources / name, folder_.file(name));
    fs::create_directory(folder_.file("build"));
    fs::create_directory_symlink(SODA_BINARY_DIR, folder_.file("build/release"));
  }

  std::vector<std::string> output_of(const Quote& quote) {
    if (is_file(quote)) {
      std::ofstream file(folder_.file(quote.command.substr(4)));
      for (const std::string& line : quote.output) file << line << "\n";
      return quote.output;
    }
    const auto result = analysis_test::run_child({"/bin/sh", "-c",
                                                  "cd '" + folder_.file(".") +
                                                      "' && PATH=build/release:$PATH && { " +
                                                      quote.command + "; } 2>&1"});
    EXPECT_NE(result.exit_code, 127) << quote.command << ": " << result.out;
    return lines_of(result.out);
  }

 private:
  TemporaryFolder folder_;
};

void check(const fs::path& page) {
  const std::vector<std::string> lines = lines_of(text_of(page));
  const std::vector<Quote> quotes = quotes_of(lines);
  std::vector<std::vector<std::string>> printed;
  std::optional<Desk> desk;
  for (const Quote& quote : quotes) {
    if (quote.starts_block && !(desk && shares_folder(lines))) desk.emplace();
    printed.push_back(desk->output_of(quote));
  }
  if (std::getenv("SODA_REWRITE_READMES")) {
    std::ofstream(page, std::ios::binary) << rewritten(lines, quotes, printed);
    return;
  }
  for (std::size_t i = 0; i < quotes.size(); ++i)
    EXPECT_EQ(difference(quotes[i], printed[i]), "")
        << page.string() << ":" << quotes[i].line << ": " << quotes[i].command
        << "\nif that is right: tests/readme/rewrite.sh";
}

TEST(Readmes, QuoteWhatTheProgramPrints) {
  for (const fs::path& page : pages()) check(page);
}

TEST(Readmes, QuoteSomething) {
  EXPECT_FALSE(quotes_of(lines_of(text_of(kSources / "README.md"))).empty());
  EXPECT_FALSE(quotes_of(lines_of(text_of(kSources / "docs/tutorial.md"))).empty());
}

const char* const kReadme =
    "Text.\n\n    not a command\n\n    $ soda run a.json\n    wall time  0.1  s\n\n    digest  77\n"
    "    ...\n\nMore.\n\n    $ cat a.json\n    {}\n    $ soda plan a.json\n    stage\n";

TEST(QuotedBlocks, AreIndentedCommandsWithWhatStandsUnderThem) {
  const std::vector<Quote> quotes = quotes_of(lines_of(kReadme));
  ASSERT_EQ(quotes.size(), 3u);
  EXPECT_EQ(quotes[0].command, "soda run a.json");
  EXPECT_EQ(quotes[0].line, 5u);
  EXPECT_EQ(quotes[0].output, (std::vector<std::string>{"wall time  0.1  s", "", "digest  77"}));
  EXPECT_TRUE(quotes[0].cut && quotes[0].starts_block);
  EXPECT_TRUE(is_file(quotes[1]) && quotes[1].starts_block);
  EXPECT_EQ(quotes[2].output, std::vector<std::string>{"stage"});
  EXPECT_FALSE(quotes[2].cut || quotes[2].starts_block);
}

TEST(QuotedBlocks, ShareAFolderWhereThePageSaysSo) {
  EXPECT_FALSE(shares_folder(lines_of(kReadme)));
  EXPECT_TRUE(shares_folder(lines_of("# Title\n\n<!-- blocks share a folder -->\n")));
}

TEST(QuotedBlocks, DifferInDigestsErrorsAndNamesAndNotInTimes) {
  const Quote quote = quotes_of(lines_of(kReadme))[0];
  EXPECT_EQ(difference(quote, {"wall time  12.5  s", "", "digest   77", "left out"}), "");
  EXPECT_NE(difference(quote, {"wall time  12.5  s", "", "digest  78"}), "");
  EXPECT_NE(difference(quote, {"wall clock  0.1  s", "", "digest  77"}), "");
  EXPECT_NE(difference(quote, {"wall time  0.1  s"}), "");
  EXPECT_NE(masked("energy drift  -0.035"), masked("energy drift  -0.036"));
  EXPECT_NE(masked("committed  24600"), masked("committed  24601"));
  EXPECT_EQ(masked("rolled back  12  solved  3"), masked("rolled back  0  solved  186"));
}

TEST(QuotedBlocks, AreRewrittenOnlyWhereMoreThanTimesDiffer) {
  const std::vector<std::string> lines = lines_of(kReadme);
  const std::vector<Quote> quotes = quotes_of(lines);
  const std::vector<std::string> same = {"wall time  9  s", "", "digest  77"};
  const std::vector<std::string> other = {"wall time  9  s", "", "digest  78", "left out"};
  EXPECT_EQ(rewritten(lines, quotes, {same, {}, {"stage"}}), kReadme);
  const std::string mended = rewritten(lines, quotes, {other, {}, {"stage", "two"}});
  EXPECT_NE(mended.find("    wall time  0.1  s\n\n    digest  78\n    ...\n"), mended.npos);
  EXPECT_EQ(mended.find("left out"), mended.npos);
  EXPECT_TRUE(mended.ends_with("    $ soda plan a.json\n    stage\n    two\n"));
}

}  // namespace
}  // namespace soda::readme
