// The pages of the repository: how long they are, where their links lead, how long sentences are.
#include "tests/readme/page_rules.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <stdexcept>

#include "tests/readme/quoted_blocks.hpp"

namespace soda::readme {
namespace {

namespace fs = std::filesystem;
using Strings = std::vector<std::string>;

constexpr std::size_t kMaxFrontWords = 900;
constexpr std::size_t kMaxReadmeLines = 150;
constexpr double kMaxMeanSentence = 22.0;

// READMEs that may be longer, each with its reason.
const std::map<std::string, std::string> kLongReadmes = {
    {"tests/mutation/README.md", "a table that run.sh reads, one row a defect"}};

struct Repository {
  std::vector<Page> pages;
  Strings files;  // and folders
};

Repository repository() {
  const fs::path root = SODA_SOURCE_DIR;
  Repository all;
  for (auto it = fs::recursive_directory_iterator(root); it != fs::end(it); ++it) {
    const std::string name = it->path().filename().string();
    if (it->is_directory() && (name == "build" || name.starts_with('.'))) {
      it.disable_recursion_pending();
      continue;
    }
    const std::string path = fs::relative(it->path(), root).generic_string();
    all.files.push_back(path);
    if (!it->is_regular_file() || it->path().extension() != ".md") continue;
    std::ifstream in(it->path(), std::ios::binary);
    all.pages.push_back({path, {std::istreambuf_iterator<char>(in), {}}});
  }
  return all;
}

bool is_of_docs(const Page& page) { return page.path.starts_with("docs/"); }

const Page& page_at(const std::vector<Page>& pages, const std::string& path) {
  for (const Page& page : pages)
    if (page.path == path) return page;
  throw std::runtime_error("no page " + path);
}

TEST(Pages, TheFirstReadmeIsShort) {
  EXPECT_LE(words_of(page_at(repository().pages, "README.md").text), kMaxFrontWords);
}

TEST(Pages, ReadmesOfFoldersAreShort) {
  std::size_t readmes = 0;
  for (const Page& page : repository().pages) {
    if (!page.path.ends_with("/README.md") || kLongReadmes.contains(page.path)) continue;
    ++readmes;
    EXPECT_LE(lines_of(page.text).size(), kMaxReadmeLines) << page.path;
  }
  EXPECT_GE(readmes, 7u);  // five layers, tests, docs
}

TEST(Pages, LinksLeadSomewhere) {
  const Repository all = repository();
  std::size_t links = 0;
  for (const Page& page : all.pages) {
    links += links_of(page.text).size();
    for (const std::string& link : broken_links(page, all.pages, all.files)) ADD_FAILURE() << link;
  }
  EXPECT_GE(links, 50u);
}

TEST(Pages, SourcesThatTheyNameAreThere) {
  const Repository all = repository();
  std::size_t named = 0;
  for (const Page& page : all.pages) {
    for (const Source& source : sources_of(page.text)) {
      ++named;
      const bool found =
          std::find(all.files.begin(), all.files.end(), source.path) != all.files.end();
      EXPECT_TRUE(found) << page.path << ":" << source.line << ": " << source.path;
    }
  }
  EXPECT_GE(named, 60u);
}

TEST(Pages, SentencesOfDocsAreShort) {
  for (const Page& page : repository().pages) {
    if (is_of_docs(page)) {
      EXPECT_LE(mean_sentence(page.text), kMaxMeanSentence) << page.path;
    }
  }
}

TEST(Pages, OfDocsAreAllInTheIndexOfTheirFolder) {
  const Repository all = repository();
  for (const std::string folder : {"docs", "docs/decisions"}) {
    const std::string index = folder + "/README.md";
    Strings named;
    for (const Link& link : links_of(page_at(all.pages, index).text))
      named.push_back(folder + "/" + link.target.substr(0, link.target.find('#')));
    for (const Page& page : all.pages) {
      if (fs::path(page.path).parent_path() != folder || page.path == index) continue;
      EXPECT_NE(std::find(named.begin(), named.end(), page.path), named.end()) << page.path;
    }
  }
}

TEST(Pages, OfDecisionsHaveFourParts) {
  std::size_t decisions = 0;
  for (const Page& page : repository().pages) {
    if (!page.path.starts_with("docs/decisions/") || page.path.ends_with("/README.md")) continue;
    ++decisions;
    for (const std::string part : {"Context", "Decision", "Evidence", "Consequence"})
      EXPECT_TRUE(page.text.find("**" + part) != page.text.npos ||
                  page.text.find("## " + part) != page.text.npos)
          << page.path << ": " << part;
  }
  EXPECT_GE(decisions, 8u);
}

// Machines take different times for it, but reach the same states.
TEST(Pages, OfResultsHaveTheGoldenDigestOfTheMainScenario) {
  std::ifstream golden(fs::path(SODA_SOURCE_DIR) / "tests/golden/digests.txt");
  std::string scene, steps, digest;
  while (scene != "library/wrecking-balls" && golden >> scene >> steps >> digest)
    golden.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  ASSERT_EQ(digest.size(), 16u);
  std::size_t results = 0;
  for (const Page& page : repository().pages) {
    if (!page.path.starts_with("docs/results/")) continue;
    ++results;
    EXPECT_NE(page.text.find("digest of the state after the last step  " + digest), page.text.npos)
        << page.path << ": analysis/benchmarks/results.sh writes it anew";
  }
  EXPECT_GE(results, 1u);
}

TEST(Pages, TheArchitectureNamesEachRoom) {
  const Repository all = repository();
  const std::string& page = page_at(all.pages, "docs/architecture.md").text;
  std::size_t rooms = 0;
  for (const std::string& path : all.files) {
    const fs::path room(path);
    const std::string layer = room.parent_path().generic_string();
    const bool has_rooms =
        layer == "kernel" || layer == "physics" || layer == "models" || layer == "analysis";
    if (!has_rooms || room.has_extension() || path == "analysis/benchmarks") continue;
    ++rooms;
    const std::size_t row = page.find("\n| " + layer + " | ");
    ASSERT_NE(row, page.npos) << layer;
    const std::string list = page.substr(row + 1, page.find('\n', row + 1) - row - 1);
    EXPECT_NE(list.find(" " + room.filename().string()), list.npos) << path;
  }
  EXPECT_GE(rooms, 40u);
}

TEST(PageRules, LinksAreThoseOutsideOfCode) {
  const std::vector<Link> links = links_of(
      "A [b](c.md#d) and ![e](f.png \"title\").\n\n    [no](link)\n\n`[no](link)`\n"
      "```\n[no](link)\n```\n| [g](h) |\n");
  ASSERT_EQ(links.size(), 3u);
  EXPECT_EQ(links[0].target, "c.md#d");
  EXPECT_EQ(links[1].target, "f.png");
  EXPECT_EQ(links[2].target, "h");
  EXPECT_EQ(links[2].line, 9u);
}

TEST(PageRules, AnchorsAreHeadingsAsGitHubWritesThem) {
  EXPECT_EQ(anchors_of("# `soda why`: one, two\n\n## A-b_c [d](e)\n\n    # code\n\n## A-b_c d\n"),
            (Strings{"soda-why-one-two", "a-b_c-d", "a-b_c-d-1"}));
}

TEST(PageRules, LinksToNoFileOrNoHeadingAreBroken) {
  const Page page = {"docs/a.md",
                     "[1](b.md) [2](b.md#c) [3](../x/) [4](#top) [5](https://e.org)\n"
                     "# Top\n[6](no.md)\n[7](b.md#no)\n[8](../x/y.cpp#c)\n"};
  const Page other = {"docs/b.md", "# C\n"};
  const Strings broken =
      broken_links(page, {page, other}, {"docs", "docs/a.md", "docs/b.md", "x", "x/y.cpp"});
  EXPECT_EQ(broken, (Strings{"docs/a.md:3: no.md: there is no such file",
                             "docs/a.md:4: b.md#no: there is no such heading",
                             "docs/a.md:5: ../x/y.cpp#c: there is no such heading"}));
}

TEST(PageRules, SourcesAreSpansOfCodeFromTheRoot) {
  const std::vector<Source> sources = sources_of(
      "`kernel/api/message.hpp` and `message.hpp`, `physics/step`\n| `tests/soak.sh` |\n"
      "\n    `kernel/no.hpp`\n\n`scenarios/NAME.json` `models/X.hpp: text` `docs/results/`\n"
      "`build/release` `analysis/` `docs` `examples/batch`\n");
  Strings paths;
  for (const Source& source : sources) paths.push_back(source.path);
  EXPECT_EQ(paths, (Strings{"kernel/api/message.hpp", "physics/step", "tests/soak.sh",
                            "docs/results", "examples/batch"}));
  ASSERT_EQ(sources.size(), 5u);
  EXPECT_EQ(sources[2].line, 2u);
}

TEST(PageRules, SentencesAreCountedInProseAlone) {
  const std::string text =
      "# A heading is no sentence\n\nOne two `three four`. Five, e.g. six!\nSeven [eight\nnine](x) "
      "ten\n\n| a table | too |\n\n    $ code too\n\n- An item\n  goes on.\n- `key`: no prose\n\n"
      "```mermaid\nnor this\n```\nLast - one.\n";
  EXPECT_EQ(sentence_lengths(text), (std::vector<std::size_t>{3, 3, 4, 4, 2}));
  EXPECT_DOUBLE_EQ(mean_sentence(text), 3.2);
  EXPECT_DOUBLE_EQ(mean_sentence("| a |\n"), 0.0);
}

TEST(PageRules, WordsAreWhatHasALetterOrADigit) {
  EXPECT_EQ(words_of("# One - 2\n\n| three | `four five` |\n|---|---|\n"), 5u);
}

}  // namespace
}  // namespace soda::readme
