#include "tests/readme/test_names.hpp"

#include <algorithm>
#include <map>
#include <regex>
#include <sstream>
#include <string_view>

namespace soda::readme {
namespace {

std::size_t line_of(const std::string& text, std::ptrdiff_t place) {
  return 1 + static_cast<std::size_t>(std::count(text.begin(), text.begin() + place, '\n'));
}

// Whether a name can be read as both, where * stands for any text in either and ? for any letter.
bool can_agree(std::string_view a, std::string_view b) {
  if (a.empty() && b.empty()) return true;
  if (a.starts_with('*'))
    return can_agree(a.substr(1), b) || (!b.empty() && can_agree(a, b.substr(1)));
  if (b.starts_with('*')) return can_agree(b, a);
  if (a.empty() || b.empty()) return false;
  const bool same = a.front() == b.front() || a.front() == '?' || b.front() == '?';
  return same && can_agree(a.substr(1), b.substr(1));
}

}  // namespace

std::vector<TestSelection> test_selections_of(const std::string& text) {
  static const std::regex filter(R"(--gtest_filter=(?:'([^']*)'|([^\s'`]+)))");
  static const std::regex ctest(R"(ctest[^`\n]* -R (?:'([^']*)'|([^\s'`]+)))");
  std::vector<TestSelection> selections;
  for (std::sregex_iterator at(text.begin(), text.end(), filter), end; at != end; ++at) {
    const std::string whole = (*at)[1].matched ? (*at)[1].str() : (*at)[2].str();
    std::istringstream patterns(whole.substr(0, whole.find('-')));  // then: what is left out
    for (std::string pattern; std::getline(patterns, pattern, ':');)
      selections.push_back({line_of(text, at->position()), pattern, false});
  }
  for (std::sregex_iterator at(text.begin(), text.end(), ctest), end; at != end; ++at)
    selections.push_back(
        {line_of(text, at->position()), (*at)[1].matched ? (*at)[1].str() : (*at)[2].str(), true});
  return selections;
}

std::vector<std::string> tests_of_source(const std::string& source) {
  static const std::regex test(R"((?:^|\n)TEST(|_F|_P)\(\s*(\w+),\s*(\w+)\))");
  static const std::regex instance(R"((?:^|\n)INSTANTIATE_TEST_SUITE_P\(\s*(\w+),\s*(\w+),)");
  std::multimap<std::string, std::string> prefixes;
  for (std::sregex_iterator at(source.begin(), source.end(), instance), end; at != end; ++at)
    prefixes.emplace((*at)[2].str(), (*at)[1].str());
  std::vector<std::string> names;
  for (std::sregex_iterator at(source.begin(), source.end(), test), end; at != end; ++at) {
    const std::string suite = (*at)[2].str(), name = suite + "." + (*at)[3].str();
    if ((*at)[1] != "_P") names.push_back(name);
    const auto [first, last] = prefixes.equal_range(suite);
    for (auto prefix = first; prefix != last; ++prefix)
      names.push_back(prefix->second + "/" + name + "/*");
  }
  return names;
}

std::vector<std::string> tests_of_cmake(const std::string& text) {
  static const std::regex test(R"(add_test\(NAME\s+(\S+))"), variable(R"(\$\{\w+\})");
  std::vector<std::string> names;
  for (std::sregex_iterator at(text.begin(), text.end(), test), end; at != end; ++at)
    names.push_back(std::regex_replace((*at)[1].str(), variable, "*"));
  std::erase(names, "*");  // would be any test
  return names;
}

bool selects_any(const TestSelection& selection, const std::vector<std::string>& tests) {
  if (!selection.is_of_ctest)
    return std::any_of(tests.begin(), tests.end(),
                       [&](const std::string& test) { return can_agree(selection.pattern, test); });
  const std::regex expression(selection.pattern);
  return std::any_of(tests.begin(), tests.end(),
                     [&](const std::string& test) { return std::regex_search(test, expression); });
}

}  // namespace soda::readme
