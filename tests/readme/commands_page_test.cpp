// docs/commands.md names every command, every option, and every key of what they print as JSON.
#include <gtest/gtest.h>

#include <algorithm>
#include <regex>
#include <set>
#include <string>

#include "tests/analysis/child_process.hpp"
#include "tests/readme/page_rules.hpp"

namespace soda::readme {
namespace {

using analysis_test::read_file;
using analysis_test::TemporaryFolder;
using Strings = std::vector<std::string>;

const std::string kSources = SODA_SOURCE_DIR;

std::string commands_page() { return read_file(kSources + "/docs/commands.md"); }

// What soda prints, run in `folder`, which looks like that of the sources.
std::string printed(const TemporaryFolder& folder, const std::string& arguments) {
  const auto result = analysis_test::run_child(
      {"/bin/sh", "-c",
       "cd '" + folder.file(".") + "' && '" SODA_BINARY_DIR "/soda' " + arguments});
  EXPECT_EQ(result.exit_code, 0) << arguments << ": " << result.err;
  return result.out;
}

// Counters of stages and ways of the kernel have names of their own (headers of the layers).
std::set<std::string> keys_of(const std::string& json) {
  static const std::regex counters(R"x("(stages|paths)": *\{[^}]*\})x"), key(R"x("([a-z_]+)": *)x");
  const std::string rest = std::regex_replace(json, counters, "\"$1\": {}");
  std::set<std::string> keys;
  for (std::sregex_iterator at(rest.begin(), rest.end(), key), end; at != end; ++at)
    keys.insert((*at)[1].str());
  return keys;
}

// As `soda --help` lists them.
Strings commands_of(const TemporaryFolder& folder) {
  const std::string help = printed(folder, "--help");
  static const std::regex line(R"(\n  ([a-z][a-z-]+) {2,})");
  Strings commands;
  for (std::sregex_iterator at(help.begin(), help.end(), line), end; at != end; ++at)
    commands.push_back((*at)[1].str());
  return commands;
}

TEST(CommandsPage, HasASectionForEachCommand) {
  const TemporaryFolder folder;
  const Strings anchors = anchors_of(commands_page()), commands = commands_of(folder);
  for (const std::string& command : commands)
    EXPECT_NE(std::find(anchors.begin(), anchors.end(), "soda-" + command), anchors.end())
        << command;
  EXPECT_GE(commands.size(), 20u);
}

TEST(CommandsPage, NamesEachOption) {
  const TemporaryFolder folder;
  const std::string page = commands_page();
  static const std::regex option(R"(\n  (?:-[a-z],)?(--[A-Za-z0-9-]+))");
  std::set<std::string> all;
  for (const std::string& command : commands_of(folder)) {
    const std::string help = printed(folder, command + " --help");
    for (std::sregex_iterator at(help.begin(), help.end(), option), end; at != end; ++at) {
      const std::string name = (*at)[1].str();
      if (name == "--help") continue;
      EXPECT_TRUE(std::regex_search(page, std::regex(name + "\\b"))) << command << " " << name;
      all.insert(name);
    }
  }
  EXPECT_GE(all.size(), 80u);
}

TEST(CommandsPage, NamesEachKeyOfTheJson) {
  const TemporaryFolder folder;
  const std::string library = kSources + "/scenarios/library/",
                    cases = kSources + "/scenarios/cases";
  const std::string scene = library + "third-world.json --steps 20";
  printed(folder, "run " + scene +
                      " --executor virtual --log a.sodalog --log-level trace --quiet > /dev/null");
  printed(folder, "run " + scene +
                      " --executor virtual --latency-us 40 --log b.sodalog "
                      "--log-level trace --quiet > /dev/null");
  analysis_test::write_file(folder.file("push.jsonl"),
                            R"({"id": 900, "type": "remove", "step": 5, "body": 1})"
                            "\n");
  const std::string page = commands_page();
  std::set<std::string> all;
  for (const std::string& command :
       Strings{"run " + scene + " --executor virtual --realtime --step-digests",
               "run " + library + "user-input.json --steps 20",
               "plan " + library + "mill.json",
               "replay a.sodalog --until 3",
               "diff a.sodalog b.sodalog",
               "log a.sodalog --lines steps",
               "log a.sodalog --lines states",
               "log a.sodalog --lines events",
               "contacts a.sodalog",
               "why a.sodalog --all",
               "what-if a.sodalog --buffer 4",
               "branch a.sodalog --step 5 --inputs push.jsonl",
               "accuracy stop --repeat 0 --cases " + cases,
               "anticipation --mode law --buffers 4 --overloads 0.5",
               "anticipation " + library + "third-world.json --over makespan --buffers 2",
               "groups --bodies 50 --seeds 1..2",
               "groups " + library + "third-world.json --steps 5",
               "scaling " + library + "third-world.json --worlds 1,4 --steps 5 --against lockstep",
               "calibrate " + library + "third-world.json --steps 5 --repeat 1 --predict 1",
               "compare " + scene,
               "phold --lps 8 --end 5 --executor virtual",
               "verify " + library +
                   "third-world.json --steps 2 --threads 1 --worlds 2 --buffers 4 --seeds 0",
               "swarm --seeds 1..2",
               "fuzz --seeds 1..1 --steps 5"}) {
    const std::set<std::string> keys = keys_of(printed(folder, command + " --json"));
    EXPECT_GE(keys.size(), 3u) << command;
    for (const std::string& key : keys)
      EXPECT_NE(page.find("`" + key + "`"), page.npos) << key << ", of soda " << command;
    all.insert(keys.begin(), keys.end());
  }
  EXPECT_GE(all.size(), 200u);
}

}  // namespace
}  // namespace soda::readme
