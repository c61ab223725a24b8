// `soda completion`, `soda manual` and `soda examples`.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <string>

#include "analysis/child_process.hpp"
#include "analysis/commands/examples_command.hpp"

namespace soda::analysis {
namespace {

using analysis_test::contains;
using analysis_test::run_soda;

TEST(Guides, BashCompletesCommandsOptionsAndValues) {
  const std::string script = run_soda({"completion", "bash"}).out;
  const auto completed = [&script](const std::string& words, int current) {
    const auto result = analysis_test::run_child({"/bin/bash", "-c",
                                                  script + "\nCOMP_WORDS=(" + words +
                                                      "); COMP_CWORD=" + std::to_string(current) +
                                                      "; _soda; printf '%s ' \"${COMPREPLY[@]}\""});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.out;
  };
  EXPECT_EQ(completed("soda an", 1), "anticipation ");
  EXPECT_EQ(completed("soda run --exec", 2), "--executor --execution-seed ");
  EXPECT_EQ(completed("soda run --balancing p", 3), "paper ");
  EXPECT_EQ(completed("soda groups --preset paper-", 3), "paper-fig6 paper-fig7 ");
  EXPECT_EQ(completed("soda --", 1), "--help --version ");
  EXPECT_EQ(completed("soda --h", 1), "--help ");
  EXPECT_EQ(completed("soda completion ''", 2), "bash zsh fish ");
  EXPECT_EQ(completed("soda accuracy free-f", 2), "free-fall ");
  EXPECT_EQ(completed("soda accuracy free-fall chain-s", 3), "chain-swing ");
  EXPECT_EQ(completed("soda run scen", 2), " ") << "files are completed by bash";
}

TEST(Guides, ExamplesNameScenesAndCommandsToTry) {
  EXPECT_TRUE(
      contains(scenes_text(SODA_SOURCE_DIR "/scenarios/library"),
               "\n  wrecking-balls.json: Ten steel balls roll through a town of 140 towers, "
               "from both sides and through eight territories\n"));
  const std::string all = run_soda({"examples"}).out;
  EXPECT_TRUE(all.starts_with("the scenes "));
  EXPECT_TRUE(contains(all, "\n  soda run scenarios/library/twelve-worlds.json\n"));
  const std::string one = run_soda({"examples", "why"}).out;
  EXPECT_TRUE(contains(one, "\n  soda why "));
  EXPECT_FALSE(contains(one, "soda run scenarios/library/twelve-worlds.json\n"));
  EXPECT_FALSE(contains(one, "wrecking-balls"));
  EXPECT_EQ(run_soda({"examples", "whi"}).exit_code, 2);
}

TEST(Guides, EveryShellAndTheManualKnowEveryCommandAndOption) {
  const std::string zsh = run_soda({"completion", "zsh"}).out;
  EXPECT_TRUE(contains(zsh, "bashcompinit"));
  const std::string fish = run_soda({"completion", "fish"}).out;
  const std::string manual = run_soda({"manual"}).out;
  for (const char* command : {"run", "why", "calibrate", "completion", "manual"}) {
    EXPECT_TRUE(contains(zsh, std::string(command) + ") words=")) << command;
    EXPECT_TRUE(contains(fish, std::string("-f -a ") + command + " -d")) << command;
    EXPECT_TRUE(contains(manual, std::string(".SS soda ") + command + "\n")) << command;
  }
  EXPECT_TRUE(contains(fish, "__fish_seen_subcommand_from run' -l ghosts"));
  EXPECT_TRUE(contains(fish, "__fish_seen_subcommand_from completion' -f -a 'bash zsh fish'"));
  EXPECT_TRUE(contains(fish, " free-fall "));
  EXPECT_TRUE(contains(manual, "\\fB\\-\\-ghosts\\fR \\fIdead\\-reckoning|predicted|told\\fR\n"));
  EXPECT_FALSE(contains(manual, "TEXT:")) << "types of the parser";
  EXPECT_FALSE(contains(manual, "INT in"));
  EXPECT_EQ(run_soda({"completion", "csh"}).exit_code, 2);
}

TEST(Guides, TheManualHasTheExitCodesOfThePage) {
  const std::string manual = run_soda({"manual"}).out;
  const std::string of_manual =
      manual.substr(std::min(manual.find(".SH EXIT STATUS"), manual.size()));
  std::ifstream page(SODA_SOURCE_DIR "/docs/commands.md");
  std::size_t codes = 0;
  bool is_there = false;
  for (std::string line; std::getline(page, line);) {
    if (line.starts_with("#")) is_there = line == "### Exit codes";
    if (!is_there || !line.starts_with("| ") || line[2] < '0' || line[2] > '9') continue;
    const std::string code = line.substr(2, line.find(" |", 2) - 2);
    EXPECT_TRUE(contains(of_manual, ".TP\n\\fB" + code + "\\fR\n")) << code;
    ++codes;
  }
  EXPECT_EQ(codes, 7u);
}

}  // namespace
}  // namespace soda::analysis
