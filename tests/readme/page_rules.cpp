#include "tests/readme/page_rules.hpp"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <map>
#include <numeric>
#include <regex>
#include <sstream>

#include "tests/readme/quoted_blocks.hpp"

namespace soda::readme {
namespace {

enum class Kind { kBlank, kText, kItem, kHeading, kTable, kCode };

struct Line {
  Kind kind = Kind::kBlank;
  std::string text;
};

bool is_item(const std::string& line) {
  static const std::regex item(R"(^ *([-*+]|[0-9]+[.)]) .*)");
  return std::regex_match(line, item);
}

// Four blanks begin a block of code only after an empty line or code, and not within a list.
std::vector<Line> classified(const std::string& text) {
  std::vector<Line> lines;
  bool fenced = false, in_list = false;
  for (const std::string& line : lines_of(text)) {
    const Kind before = lines.empty() ? Kind::kBlank : lines.back().kind;
    const bool fence = line.starts_with("```");
    Kind kind = Kind::kText;
    if (fenced || fence)
      kind = Kind::kCode;
    else if (line.empty())
      kind = before == Kind::kCode ? Kind::kCode : Kind::kBlank;
    else if (line.starts_with("    ") && !in_list && before != Kind::kText)
      kind = Kind::kCode;
    else if (line.starts_with("#"))
      kind = Kind::kHeading;
    else if (line.starts_with("|") || line.starts_with("<"))
      kind = Kind::kTable;
    else if (is_item(line))
      kind = Kind::kItem;
    if (fence) fenced = !fenced;
    if (kind == Kind::kItem) in_list = true;
    if (kind == Kind::kHeading || (kind == Kind::kText && !line.starts_with(" ") &&
                                   (before == Kind::kBlank || before == Kind::kCode)))
      in_list = false;
    lines.push_back({kind, line});
  }
  return lines;
}

std::string without_spans(const std::string& text, const std::string& instead) {
  static const std::regex span("``.*?``|`[^`]*`");
  return std::regex_replace(text, span, instead);
}

std::size_t count_words(const std::string& text) {
  std::istringstream in(text);
  std::size_t words = 0;
  for (std::string word; in >> word;)
    words += std::any_of(word.begin(), word.end(), [](unsigned char c) { return std::isalnum(c); });
  return words;
}

// Ends of sentences: a mark, what closes behind it, a blank, and no small letter after that.
void add_sentences(const std::string& prose, std::vector<std::size_t>& lengths) {
  static const std::regex picture(R"(!\[[^\]]*\]\([^)]*\))"), link(R"(\[([^\]]*)\]\([^)]*\))");
  static const std::regex end(R"([.!?]["')*_\]]*\s+(?![a-z]))");
  std::string text = without_spans(prose, "code");
  text = std::regex_replace(std::regex_replace(text, picture, ""), link, "$1");
  for (std::sregex_token_iterator part(text.begin(), text.end(), end, -1), last; part != last;
       ++part)
    if (const std::size_t words = count_words(part->str()); words > 0) lengths.push_back(words);
}

std::string anchor_of(const std::string& heading) {
  static const std::regex link(R"(\[([^\]]*)\]\([^)]*\))");
  const std::string title = std::regex_replace(heading, link, "$1");
  std::string anchor;
  for (const char c : title.substr(std::min(title.size(), title.find_first_not_of("# ")))) {
    const auto letter = static_cast<unsigned char>(c);
    if (std::isalnum(letter) || c == '-' || c == '_' || letter >= 0x80)
      anchor += static_cast<char>(std::tolower(letter));
    else if (c == ' ')
      anchor += '-';
  }
  return anchor;
}

bool leads_outside(const std::string& target) {
  return target.find("://") != std::string::npos || target.starts_with("mailto:");
}

}  // namespace

std::vector<Link> links_of(const std::string& text) {
  static const std::regex pattern(R"(\]\(([^)\s]+)[^)]*\))");
  std::vector<Link> links;
  const std::vector<Line> lines = classified(text);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (lines[i].kind == Kind::kCode) continue;
    const std::string line = without_spans(lines[i].text, "code");
    for (std::sregex_iterator at(line.begin(), line.end(), pattern), end; at != end; ++at)
      links.push_back({i + 1, (*at)[1].str()});
  }
  return links;
}

std::vector<Source> sources_of(const std::string& text) {
  static const std::regex pattern(
      "`((?:kernel|physics|models|scenarios|library|analysis|tests|docs|examples|cmake)"
      "/[a-z0-9_./-]*[a-z0-9_])/?`");
  std::vector<Source> sources;
  const std::vector<Line> lines = classified(text);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (lines[i].kind == Kind::kCode) continue;
    const std::string& line = lines[i].text;
    for (std::sregex_iterator at(line.begin(), line.end(), pattern), end; at != end; ++at)
      sources.push_back({i + 1, (*at)[1].str()});
  }
  return sources;
}

std::vector<std::string> anchors_of(const std::string& text) {
  std::vector<std::string> anchors;
  std::map<std::string, int> seen;
  for (const Line& line : classified(text)) {
    if (line.kind != Kind::kHeading) continue;
    const std::string anchor = anchor_of(line.text);
    const int before = seen[anchor]++;
    anchors.push_back(before == 0 ? anchor : anchor + "-" + std::to_string(before));
  }
  return anchors;
}

std::size_t words_of(const std::string& text) { return count_words(text); }

std::vector<std::size_t> sentence_lengths(const std::string& text) {
  std::vector<std::size_t> lengths;
  std::string paragraph;
  bool keys = false;  // an item that begins with code, and its further lines
  const auto finish = [&] {
    if (!keys) add_sentences(paragraph, lengths);
    paragraph.clear();
    keys = false;
  };
  for (const Line& line : classified(text)) {
    if (line.kind != Kind::kText) finish();
    if (line.kind == Kind::kItem) {
      const std::size_t begin = line.text.find(' ', line.text.find_first_not_of(' '));
      paragraph = line.text.substr(begin + 1);
      keys = paragraph.starts_with("`") || paragraph.starts_with("**`");
    } else if (line.kind == Kind::kText) {
      paragraph += " " + line.text;
    }
  }
  finish();
  return lengths;
}

double mean_sentence(const std::string& text) {
  const std::vector<std::size_t> lengths = sentence_lengths(text);
  const auto words = std::accumulate(lengths.begin(), lengths.end(), std::size_t{0});
  return lengths.empty() ? 0.0 : static_cast<double>(words) / static_cast<double>(lengths.size());
}

std::vector<std::string> broken_links(const Page& page, const std::vector<Page>& pages,
                                      const std::vector<std::string>& files) {
  std::vector<std::string> broken;
  const std::filesystem::path folder = std::filesystem::path(page.path).parent_path();
  for (const Link& link : links_of(page.text)) {
    if (leads_outside(link.target)) continue;
    const std::size_t mark = std::min(link.target.find('#'), link.target.size());
    const std::string file = link.target.substr(0, mark);
    std::string path = (folder / file).lexically_normal().generic_string();
    if (file.empty()) path = page.path;
    while (path.ends_with('/')) path.pop_back();
    const auto say = [&](const std::string& what) {
      broken.push_back(page.path + ":" + std::to_string(link.line) + ": " + link.target + ": " +
                       what);
    };
    if (std::find(files.begin(), files.end(), path) == files.end()) {
      say("there is no such file");
    } else if (mark < link.target.size()) {
      const auto is_it = [&path](const Page& other) { return other.path == path; };
      const auto found = std::find_if(pages.begin(), pages.end(), is_it);
      const std::vector<std::string> anchors =
          found == pages.end() ? std::vector<std::string>{} : anchors_of(found->text);
      if (std::find(anchors.begin(), anchors.end(), link.target.substr(mark + 1)) == anchors.end())
        say("there is no such heading");
    }
  }
  return broken;
}

}  // namespace soda::readme
