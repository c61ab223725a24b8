// The page of `soda view` in a browser: headless Chromium does what a user does, and tells.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <sstream>
#include <string>
#include <utility>

#include "analysis/child_process.hpp"
#include "analysis/text/exit_codes.hpp"

namespace soda::analysis {
namespace {

using analysis_test::contains;
using analysis_test::library_file;
using analysis_test::read_file;
using analysis_test::run_child;
using analysis_test::run_soda;
using analysis_test::TemporaryFolder;
using analysis_test::write_file;

std::optional<std::string> find_browser() {
  const char* const path = std::getenv("PATH");
  std::istringstream folders(path == nullptr ? "" : path);
  for (std::string folder; std::getline(folders, folder, ':');)
    for (const char* name : {"chromium", "chromium-browser", "google-chrome"})
      if (const std::string file = folder + "/" + name; std::filesystem::exists(file)) return file;
  return std::nullopt;
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return at == std::string::npos ? text : text.replace(at, what.size(), by);
}

// Whatever the page tells of as an error, from its first script on.
constexpr const char* kErrors =
    "<head><script>const faults = [], tell = console.error;"
    "console.error = (...words) => { faults.push('console: ' + words.join(' ')); tell(...words); };"
    "addEventListener('error', event => faults.push('error: ' + event.message));"
    "addEventListener('unhandledrejection', event => faults.push('error: ' + event.reason));"
    // A browser that shows a page after so much time of its own lets that pass by timers only.
    "requestAnimationFrame = draw => setTimeout(() => draw(performance.now()), 16);"
    "</script>";

class ViewInABrowser : public testing::Test {
 protected:
  void SetUp() override {
    browser_ = find_browser();
    if (!browser_) GTEST_SKIP() << "there is no Chromium here to open the page with";
    const auto ran = run_soda({"run", library_file("border-stack"), "--steps", "120", "--executor",
                               "virtual", "--log", log_, "--log-level", "trace"});
    ASSERT_EQ(ran.exit_code, kExitOk) << ran.err;
    ASSERT_EQ(run_soda({"view", log_, "-o", folder_.file("page.html")}).exit_code, kExitOk);
    page_ = read_file(folder_.file("page.html"));
  }

  // The page after all acts, as the browser has it.
  std::string acted(const std::string& page, const std::string& size) {
    const std::string acts = read_file(SODA_SOURCE_DIR "/tests/analysis/viewer_acts.js");
    const std::string file = folder_.file("acts.html");
    write_file(file, replaced(replaced(page, "<head>", kErrors), "</body>",
                              "<script>" + acts + "</script></body>"));
    const auto ran =
        run_child({*browser_, "--headless=new", "--no-sandbox", "--disable-dev-shm-usage",
                   "--enable-unsafe-swiftshader", "--use-angle=swiftshader",
                   "--window-size=" + size, "--user-data-dir=" + folder_.file("profile"),
                   "--virtual-time-budget=15000", "--dump-dom", "file://" + file});
    return ran.out;
  }
  static std::string text_of(const std::string& dom, const std::string& id) {
    const std::size_t at = dom.find("<pre id=\"" + id + "\"");
    if (at == std::string::npos) return "nothing of " + id + " in the page:\n" + dom.substr(0, 400);
    const std::size_t from = dom.find('>', at) + 1;
    return dom.substr(from, dom.find("</pre>", from) - from);
  }

  const TemporaryFolder folder_;
  const std::string log_ = folder_.file("run.sodalog");
  std::optional<std::string> browser_;
  std::string page_;
};

TEST_F(ViewInABrowser, OneCursorMovesAllPanelsAndAClickTellsWhatLedToARollback) {
  for (const char* size : {"1280,800", "390,844"}) {
    const std::string dom = acted(page_, size);
    EXPECT_EQ(text_of(dom, "verdict"), "all is well") << size;
    // The page says what `soda why` says.
    std::istringstream told(text_of(dom, "rollback-told"));
    std::string number, line;
    std::getline(told, number);
    const auto why = run_soda({"why", log_, "--rollback", number});
    ASSERT_EQ(why.exit_code, kExitOk) << why.err;
    std::size_t lines = 0;
    for (; std::getline(told, line); ++lines) EXPECT_TRUE(contains(why.out, line)) << line;
    EXPECT_GE(lines, 3u);
  }
}

TEST_F(ViewInABrowser, FaultsOfThePageAreFound) {
  const std::pair<const char*, const char*> defects[] = {
      {"  showPlots();\n", ""},
      {"  chooseRollback(found);\n", ""},
      {"for (const arrow of rollback.arrows)", "for (const arrow of [])"},
      {"if (event.key === 'Escape') focused.blur();\n    return;", ""},
      {"Math.round(frame / marks.every)", "Math.floor(frame / marks.every)"},
      {"begin();", "begin(); console.error('a complaint');"}};
  for (const auto& [right, wrong] : defects) {
    const std::string verdict =
        text_of(acted(replaced(page_, right, wrong), "1280,800"), "verdict");
    EXPECT_FALSE(verdict.empty() || contains(verdict, "all is well") ||
                 contains(verdict, "nothing of"))
        << right << ": " << verdict;
  }
}

}  // namespace
}  // namespace soda::analysis
