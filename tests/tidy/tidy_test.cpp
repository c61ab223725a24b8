// The rules applied to this repository.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "tidy/tidy_rules.hpp"

namespace soda::tidy {
namespace {

namespace fs = std::filesystem;

// Longest function allowed, and most parameters of one: as CONTRIBUTING.md says.
constexpr std::size_t kMaxFunctionLines = 60;
constexpr std::size_t kMostParameters = 6;

// Files that may be longer than 400 lines, each with its reason.
const std::map<std::string, std::string> kLongFiles = {};

std::string read(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

bool is_text(const fs::path& path) {
  const std::string name = path.filename().string();
  const std::string ending = path.extension().string();
  return ending == ".hpp" || ending == ".cpp" || ending == ".md" || ending == ".sh" ||
         name == "CMakeLists.txt" || name == "CMakePresets.json";
}

bool is_code(const std::string& path) { return path.ends_with(".hpp") || path.ends_with(".cpp"); }

std::vector<SourceFile> repository() {
  const fs::path root = SODA_SOURCE_DIR;
  std::vector<SourceFile> files;
  for (auto it = fs::recursive_directory_iterator(root); it != fs::end(it); ++it) {
    const std::string name = it->path().filename().string();
    if (it->is_directory() && (name == "build" || name.starts_with('.'))) {
      it.disable_recursion_pending();
      continue;
    }
    if (!it->is_regular_file() || !is_text(it->path())) continue;
    files.push_back({fs::relative(it->path(), root).generic_string(), read(it->path())});
  }
  std::sort(files.begin(), files.end(),
            [](const SourceFile& a, const SourceFile& b) { return a.path < b.path; });
  return files;
}

std::string report(const std::vector<Finding>& findings) {
  std::string text;
  for (const Finding& finding : findings) {
    text += finding.path + ":" + std::to_string(finding.line) + ": " + finding.what + "\n";
  }
  return text;
}

template <class Check>
std::string check_all(Check check) {
  std::vector<Finding> all;
  for (const SourceFile& file : repository()) {
    const std::vector<Finding> found = check(file);
    all.insert(all.end(), found.begin(), found.end());
  }
  return report(all);
}

TEST(Tidy, TheWalkFindsEveryLayer) {
  std::map<std::string, int> files;
  for (const SourceFile& file : repository()) ++files[file.path.substr(0, file.path.find('/'))];
  for (const char* folder :
       {"kernel", "physics", "models", "scenarios", "library", "analysis", "tests"}) {
    EXPECT_GT(files[folder], 3) << folder;
  }
}

TEST(Tidy, IncludesFollowTheLayers) { EXPECT_EQ(check_all(check_layers), ""); }

TEST(Tidy, RoomsOfALayerIncludeOnlyLowerOnes) { EXPECT_EQ(check_all(check_rooms), ""); }

TEST(Tidy, HeavyHeadersStayInTheirFiles) {
  EXPECT_EQ(report(check_heavy_headers(repository())), "");
}

TEST(Tidy, FclIsIncludedInExactlyTwoProductFiles) {
  int users = 0;
  for (const SourceFile& file : repository()) {
    if (!file.path.starts_with("physics/")) continue;
    users += file.text.find("#include <fcl/") != std::string::npos ? 1 : 0;
  }
  EXPECT_EQ(users, 2);
}

TEST(Tidy, BannedWordsAreAbsent) {
  EXPECT_EQ(check_all([](const SourceFile& file) -> std::vector<Finding> {
              // The rules and their test have to name what they ban.
              if (file.path.starts_with("tests/tidy/")) return {};
              return check_banned_words(file);
            }),
            "");
}

TEST(Tidy, LinesAreShortAndClean) {
  EXPECT_EQ(check_all([](const SourceFile& file) -> std::vector<Finding> {
              if (!is_code(file.path)) return {};  // tables of READMEs may be wide
              return check_lines(file);
            }),
            "");
}

TEST(Tidy, FilesAreShort) {
  EXPECT_EQ(check_all([](const SourceFile& file) -> std::vector<Finding> {
              if (!is_code(file.path) || kLongFiles.contains(file.path)) return {};
              return check_file_length(file);
            }),
            "");
}

TEST(Tidy, FunctionsAreShort) {
  EXPECT_EQ(check_all([](const SourceFile& file) -> std::vector<Finding> {
              if (!is_code(file.path) || file.path.starts_with("tests/")) return {};
              return check_function_length(file, kMaxFunctionLines);
            }),
            "");
}

TEST(Tidy, FunctionsTakeFewParameters) {
  EXPECT_EQ(check_all([](const SourceFile& file) -> std::vector<Finding> {
              if (!is_code(file.path) || file.path.starts_with("tests/")) return {};
              return check_parameters(file, kMostParameters);
            }),
            "");
}

TEST(Tidy, NothingIsLeftOver) { EXPECT_EQ(check_all(check_leftovers), ""); }

TEST(Tidy, EveryReadmeNamesEachHeaderOfItsFolder) {
  const std::vector<SourceFile> files = repository();
  std::vector<Finding> findings;
  for (const std::string folder :
       {"kernel", "physics", "models", "scenarios", "library", "analysis"}) {
    SourceFile readme{folder + "/README.md", ""};
    std::vector<std::string> headers;
    for (const SourceFile& file : files) {
      if (file.path == readme.path) readme.text = file.text;
      if (!file.path.starts_with(folder + "/") || !file.path.ends_with(".hpp")) continue;
      headers.push_back(fs::path(file.path).filename().string());
    }
    const std::vector<Finding> found = check_readme(readme, headers);
    findings.insert(findings.end(), found.begin(), found.end());
  }
  EXPECT_EQ(report(findings), "");
}

}  // namespace
}  // namespace soda::tidy
