#include "tests/readme/quoted_blocks.hpp"

#include <algorithm>
#include <regex>
#include <sstream>

namespace soda::readme {
namespace {

constexpr std::string_view kIndent = "    ";

bool is_indented(const std::string& line) { return line.starts_with(kIndent); }

// Empty lines belong to a block if indented ones follow.
std::size_t end_of_block(const std::vector<std::string>& lines, std::size_t at) {
  std::size_t end = at;
  for (std::size_t i = at; i < lines.size() && (lines[i].empty() || is_indented(lines[i])); ++i)
    if (!lines[i].empty()) end = i + 1;
  return end;
}

std::string unindented(const std::string& line) {
  return line.empty() ? line : line.substr(kIndent.size());
}

}  // namespace

std::vector<std::string> lines_of(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

std::vector<Quote> quotes_of(const std::vector<std::string>& lines) {
  std::vector<Quote> quotes;
  bool inside = false;
  for (std::size_t i = 0, end = 0; i < lines.size(); ++i) {
    if (i >= end) inside = false;
    if (lines[i].starts_with("    $ ")) {
      if (!inside) end = end_of_block(lines, i);
      quotes.push_back({i + 1, i + 1, lines[i].substr(6), {}, false, !inside});
      inside = true;
    } else if (inside) {
      quotes.back().output.push_back(unindented(lines[i]));
    }
  }
  for (Quote& quote : quotes)
    if (!quote.output.empty() && quote.output.back() == "...") {
      quote.output.pop_back();
      quote.cut = true;
    }
  return quotes;
}

bool shares_folder(const std::vector<std::string>& lines) {
  return std::find(lines.begin(), lines.end(), "<!-- blocks share a folder -->") != lines.end();
}

bool is_file(const Quote& quote) { return quote.command.starts_with("cat "); }

std::string masked(const std::string& line) {
  static const std::regex kFigure(
      "\\b(wall time|CPU time|rate|real-time factor|executed|rolled back|stragglers|"
      "anti-messages|efficiency|solved|reused|at rest|mean|largest) +-?[0-9][0-9.e+-]*");
  static const std::regex kDuration("\\bin [0-9][0-9.e+-]* s\\b");
  static const std::regex kStored("[0-9]+ entries stored; .*");
  static const std::regex kAccount("workers' time: .*");
  static const std::regex kSpaces(" {2,}"), kDashes("-{3,}");
  std::string text = std::regex_replace(line, kFigure, "$1 ~");
  text = std::regex_replace(text, kDuration, "in ~ s");
  text = std::regex_replace(text, kStored, "~ entries stored");
  text = std::regex_replace(text, kAccount, "workers' time");
  text = std::regex_replace(text, kSpaces, "  ");
  return std::regex_replace(text, kDashes, "---");
}

std::string difference(const Quote& quote, const std::vector<std::string>& printed) {
  const std::size_t most =
      quote.cut ? quote.output.size() : std::max(quote.output.size(), printed.size());
  for (std::size_t i = 0; i < most; ++i) {
    const std::string said = i < quote.output.size() ? quote.output[i] : "(no more)";
    const std::string is = i < printed.size() ? printed[i] : "(no more)";
    if (masked(said) != masked(is)) return "quoted:  " + said + "\nprinted: " + is;
  }
  return "";
}

std::string rewritten(std::vector<std::string> lines, const std::vector<Quote>& quotes,
                      const std::vector<std::vector<std::string>>& printed) {
  // From the last on, so that places stay what they are.
  for (std::size_t q = quotes.size(); q-- > 0;) {
    const Quote& quote = quotes[q];
    if (is_file(quote) || difference(quote, printed[q]).empty()) continue;
    const auto first = lines.begin() + static_cast<std::ptrdiff_t>(quote.first);
    std::vector<std::string> output = printed[q];
    if (quote.cut) output.resize(std::min(output.size(), quote.output.size()));
    for (std::size_t i = 0; i < output.size(); ++i) {
      if (i < quote.output.size() && masked(output[i]) == masked(quote.output[i]))
        output[i] = quote.output[i];
      if (!output[i].empty()) output[i].insert(0, kIndent);
    }
    lines.insert(lines.erase(first, first + static_cast<std::ptrdiff_t>(quote.output.size())),
                 output.begin(), output.end());
  }
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

}  // namespace soda::readme
