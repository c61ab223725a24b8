#include "tidy/tidy_rules.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <regex>
#include <set>
#include <sstream>

namespace soda::tidy {
namespace {

constexpr std::size_t kMaxColumns = 100;
constexpr std::size_t kMaxFileLines = 400;

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

std::string folder_of(const std::string& path) { return path.substr(0, path.find('/')); }

bool is_product(const std::string& folder) {
  static const std::set<std::string> layers = {"kernel",    "physics", "models",
                                               "scenarios", "library", "analysis"};
  return layers.contains(folder);
}

bool is_header(const std::string& path) { return path.ends_with(".hpp"); }

// The target of an #include line, with its delimiters; empty for other lines.
std::string include_of(const std::string& line) {
  static const std::regex pattern(R"(^\s*#\s*include\s*(["<][^">]+[">]))");
  std::smatch match;
  return std::regex_search(line, match, pattern) ? match[1].str() : std::string();
}

template <class Check>
std::vector<Finding> for_each_line(const SourceFile& file, Check check) {
  std::vector<Finding> findings;
  const std::vector<std::string> lines = lines_of(file.text);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::string what = check(lines[i]);
    if (!what.empty()) findings.push_back({file.path, i + 1, what});
  }
  return findings;
}

struct BannedWord {
  std::regex pattern;
  std::set<std::string> folders;  // where; empty: everywhere
  std::string instead;
};

// Split literals keep this file from finding itself.
const std::vector<BannedWord>& banned_words() {
  static const std::set<std::string> state = {"kernel", "physics", "models"};
  static const std::vector<BannedWord> words = {
      {std::regex("\\bunordered_(map|set|multimap|multiset)\\b"), state,
       "iteration order leaks into state: use a sorted vector or std::map"},
      {std::regex("\\b(std::)?s?rand\\s*\\("), {}, "use a seeded generator of its own"},
      {std::regex("\\brandom_device\\b"), {}, "use a seed from the scenario"},
      {std::regex("\\bthread_local\\b"), {}, "pass what a thread needs as an argument"},
      {std::regex("\\b(printf|puts)\\s*\\("), state,
       "handlers run speculatively: nothing leaves the program before GVT"},
      {std::regex("\\bstd::(cout|cerr|clog)\\b"), state,
       "handlers run speculatively: nothing leaves the program before GVT"},
      {std::regex("\\b(std::)?(sin|cos|tan|exp|pow|atan2|acos|asin|log|hypot|cbrt|fma)\\s*\\("),
       {"physics", "models"},
       "libm differs between CPUs: sqrt and rational functions only in state paths"},
      {std::regex("\\bstd::(reduce|transform_reduce|sort_heap|unstable)\\b"), state,
       "order is not fixed: write the loop"},
      {std::regex("\\bfriend class\\b"), {}, "test through the seams of the product"},
  };
  return words;
}

// Also in comments, build files and texts.
const std::vector<BannedWord>& banned_texts() {
  static const std::vector<BannedWord> words = {
      {std::regex("-ff"
                  "ast-math|-march=|-mavx|-Of"
                  "ast"),
       {},
       "changes bits between machines"},
      {std::regex("look"
                  "ahead",
                  std::regex::icase),
       {},
       "means something else in PDES: say anticipation"},
  };
  return words;
}

// PHOLD's own name for its least delay is an option of `soda phold`; the word is banned otherwise.
std::string without_phold_option(const std::string& text) {
  static const std::regex option(R"((^|[\s"'`])--lookahead\b)");
  return std::regex_replace(text, option, "$1");
}

std::vector<Finding> find_words(const SourceFile& file, const std::string& text,
                                const std::vector<BannedWord>& words) {
  const std::string folder = folder_of(file.path);
  return for_each_line({file.path, text}, [&](const std::string& line) -> std::string {
    for (const BannedWord& word : words) {
      if (!word.folders.empty() && !word.folders.contains(folder)) continue;
      std::smatch match;
      if (std::regex_search(line, match, word.pattern)) {
        return "'" + match.str() + "': " + word.instead;
      }
    }
    return {};
  });
}

// Last words before an abort are the only output of a layer whose code may run speculatively.
std::vector<Finding> find_quiet_fprintf(const SourceFile& file, const std::string& code) {
  static const std::set<std::string> folders = {"kernel", "physics", "models"};
  constexpr std::size_t kLinesUntilAbort = 4;
  if (!folders.contains(folder_of(file.path))) return {};
  std::vector<Finding> findings;
  const std::vector<std::string> lines = lines_of(code);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (lines[i].find("fprintf(") == std::string::npos) continue;
    bool aborts = false;
    for (std::size_t j = i; j < std::min(lines.size(), i + kLinesUntilAbort); ++j) {
      aborts = aborts || lines[j].find("abort(") != std::string::npos;
    }
    if (!aborts) findings.push_back({file.path, i + 1, "fprintf that no abort follows"});
  }
  return findings;
}

}  // namespace

std::vector<Finding> check_layers(const SourceFile& file) {
  static const std::map<std::string, std::set<std::string>> allowed = {
      {"kernel", {"kernel"}},
      {"physics", {"physics"}},
      {"models", {"models", "kernel", "physics"}},
      {"scenarios", {"scenarios", "models", "kernel", "physics"}},
      {"analysis", {"analysis", "scenarios", "models", "kernel", "physics"}},
      {"library", {"library", "soda", "scenarios", "models", "kernel", "physics"}},
  };
  const std::string folder = folder_of(file.path);
  if (!is_product(folder)) return {};
  return for_each_line(file, [&](const std::string& line) -> std::string {
    const std::string include = include_of(line);
    if (include.empty() || include.front() != '"') return {};
    const std::string target = folder_of(include.substr(1, include.size() - 2));
    // What embedders include shows nothing of the layers.
    if (file.path.starts_with("library/include/") && target != "soda")
      return "a header of the library must not include " + include;
    if (allowed.at(folder).contains(target)) return {};
    return folder + "/ must not include " + include;
  });
}

std::vector<Finding> check_rooms(const SourceFile& file) {
  // Upwards: a room includes those before it.
  static const std::map<std::string, std::vector<std::string>> rooms_of = {
      {"kernel", {"api", "queues", "time_warp", "gvt", "executors", "virtual_cluster", "phold"}},
      {"physics",
       {"model", "math", "forces", "shapes", "broadphase", "narrowphase", "continuous", "queries",
        "constraints", "measures", "solvers", "integrators", "refinement", "events", "step"}},
      {"models",
       {"territory", "messages", "user_input", "options", "cost", "islands", "ghosts",
        "transform_buffer", "load_balancing", "commit", "world", "run", "real_time"}},
      {"analysis",
       {"text", "process", "measures", "accuracy", "runs", "families", "event_log", "anticipation",
        "scaling", "calibration", "branch", "trace", "groups", "viewer", "search", "whole",
        "commands"}},
  };
  const std::string layer = folder_of(file.path);
  const bool is_code = is_header(file.path) || file.path.ends_with(".cpp");
  const bool measures_by_itself = file.path.starts_with("analysis/benchmarks/");  // programs
  if (!rooms_of.contains(layer) || !is_code || measures_by_itself) return {};
  const std::vector<std::string>& upwards = rooms_of.at(layer);
  const auto floor_of = [&upwards](const std::string& path) {
    const std::size_t begin = path.find('/') + 1, end = path.find('/', begin);
    const std::string room = end == std::string::npos ? "" : path.substr(begin, end - begin);
    return std::find(upwards.begin(), upwards.end(), room) - upwards.begin();
  };
  const std::ptrdiff_t floor = floor_of(file.path);
  if (floor == std::ssize(upwards)) return {{file.path, 0, "is in no room of " + layer + "/"}};
  return for_each_line(file, [&](const std::string& line) -> std::string {
    const std::string include = include_of(line);
    if (!include.starts_with("\"" + layer + "/")) return {};
    if (floor_of(include.substr(1, include.size() - 2)) <= floor) return {};
    return "must not include " + include + " of a higher room";
  });
}

std::vector<Finding> check_heavy_headers(const std::vector<SourceFile>& files) {
  const std::map<std::string, std::map<std::string, std::size_t>> most = {
      {"<fcl/", {{"physics", 2}}},
      {"<nlohmann/", {{"scenarios", 1}, {"analysis", 1}}},
      {"<CLI/", {{"analysis", 6}}},
  };
  std::vector<Finding> findings;
  std::map<std::pair<std::string, std::string>, std::set<std::string>> users;
  for (const SourceFile& file : files) {
    const std::string folder = folder_of(file.path);
    // Benchmarks are no product files: the floor of physics is FCL itself.
    if (!is_product(folder) || file.path.starts_with("analysis/benchmarks/")) continue;
    for (const auto& [prefix, folders] : most) {
      const auto found = for_each_line(file, [&, p = prefix](const std::string& line) {
        return include_of(line).starts_with(p) ? "includes " + p + "...>" : std::string();
      });
      if (found.empty()) continue;
      if (is_header(file.path) || !folders.contains(folder)) findings.push_back(found.front());
      users[{prefix, folder}].insert(file.path);
    }
  }
  for (const auto& [key, paths] : users) {
    const auto& folders = most.at(key.first);
    const std::size_t limit = folders.contains(key.second) ? folders.at(key.second) : 0;
    if (paths.size() <= limit) continue;
    findings.push_back({*paths.rbegin(), 0,
                        std::to_string(paths.size()) + " files of " + key.second + "/ include " +
                            key.first + "...>; allowed: " + std::to_string(limit)});
  }
  return findings;
}

std::vector<Finding> check_banned_words(const SourceFile& file) {
  const bool code = is_header(file.path) || file.path.ends_with(".cpp");
  std::vector<Finding> findings = find_words(file, without_phold_option(file.text), banned_texts());
  if (!code) return findings;
  const std::string text = without_comments_and_literals(file.text);
  for (const std::vector<Finding>& more :
       {find_words(file, text, banned_words()), find_quiet_fprintf(file, text)}) {
    findings.insert(findings.end(), more.begin(), more.end());
  }
  return findings;
}

std::vector<Finding> check_lines(const SourceFile& file) {
  std::vector<Finding> findings = for_each_line(file, [](const std::string& line) -> std::string {
    // Characters, not bytes: continuation bytes of UTF-8 do not count.
    const auto columns =
        std::count_if(line.begin(), line.end(), [](char c) { return (c & 0xC0) != 0x80; });
    if (static_cast<std::size_t>(columns) > kMaxColumns) {
      return std::to_string(columns) + " characters; allowed: " + std::to_string(kMaxColumns);
    }
    if (line.find('\t') != std::string::npos) return "tab";
    if (!line.empty() && (line.back() == ' ' || line.back() == '\r')) return "trailing space";
    return {};
  });
  if (!file.text.empty() && file.text.back() != '\n') {
    findings.push_back({file.path, 0, "no line break at the end"});
  }
  return findings;
}

std::vector<Finding> check_file_length(const SourceFile& file) {
  const std::size_t lines = lines_of(file.text).size();
  if (lines <= kMaxFileLines) return {};
  return {{file.path, 0,
           std::to_string(lines) + " lines; allowed: " + std::to_string(kMaxFileLines) +
               ": split it by concept"}};
}

std::vector<Finding> check_leftovers(const SourceFile& file) {
  static const std::regex pattern(
      "\\b(TO"
      "DO|FIX"
      "ME|XX"
      "X|HA"
      "CK)\\b");
  return for_each_line(file, [](const std::string& line) -> std::string {
    std::smatch match;
    return std::regex_search(line, match, pattern) ? match.str() + ": finish it or drop it"
                                                   : std::string();
  });
}

std::vector<Finding> check_readme(const SourceFile& readme,
                                  const std::vector<std::string>& headers) {
  std::vector<Finding> findings;
  for (const std::string& header : headers) {
    if (readme.text.find(header) == std::string::npos) {
      findings.push_back({readme.path, 0, "does not name " + header});
    }
  }
  return findings;
}

std::string without_comments_and_literals(const std::string& text) {
  std::string out;
  out.reserve(text.size());
  const auto starts = [&](std::size_t i, const char* token) {
    return text.compare(i, std::char_traits<char>::length(token), token) == 0;
  };
  const auto blank_to = [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) out += text[i] == '\n' ? '\n' : ' ';
  };
  std::size_t i = 0;
  while (i < text.size()) {
    std::size_t end = i;
    if (starts(i, "//")) {
      end = std::min(text.find('\n', i), text.size());
    } else if (starts(i, "/*")) {
      const std::size_t close = text.find("*/", i + 2);
      end = close == std::string::npos ? text.size() : close + 2;
    } else if (starts(i, "R\"")) {
      const std::size_t open = text.find('(', i);
      if (open != std::string::npos) {
        const std::string close = ")" + text.substr(i + 2, open - i - 2) + "\"";
        const std::size_t found = text.find(close, open);
        end = found == std::string::npos ? text.size() : found + close.size();
      }
    } else if (text[i] == '"' ||
               (text[i] == '\'' &&
                (i == 0 || !std::isalnum(static_cast<unsigned char>(text[i - 1]))))) {
      const char quote = text[i];
      end = i + 1;
      while (end < text.size() && text[end] != quote && text[end] != '\n') {
        end += text[end] == '\\' ? 2 : 1;
      }
      end = std::min(end + 1, text.size());
    }
    if (end == i) {
      out += text[i++];
    } else {
      blank_to(i, end);
      i = end;
    }
  }
  return out;
}

}  // namespace soda::tidy
