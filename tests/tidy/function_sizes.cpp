#include <regex>
#include <tuple>

#include "tidy/tidy_rules.hpp"

namespace soda::tidy {
namespace {

enum class Scope { kNamespace, kType, kFunction, kOther };

// What a block is that the statement `head` (everything since the last ; { or }) opens.
Scope scope_of(const std::string& head, Scope outer) {
  static const std::regex space(R"(\bnamespace\b|extern\s*$)");
  static const std::regex type(R"(\b(class|struct|enum|union)\b(\s*alignas\([^()]*\))?[^()]*$)");
  if (outer == Scope::kFunction || outer == Scope::kOther) return Scope::kOther;
  if (std::regex_search(head, space)) return Scope::kNamespace;
  if (std::regex_search(head, type)) return Scope::kType;
  // An initialiser, as in `int a{1}` or `x = {...}`: no parameter list, or an assignment.
  static const std::regex assignment(R"([^=!<>]=\s*$)");
  if (head.find('(') == std::string::npos || std::regex_search(head, assignment)) {
    return Scope::kOther;
  }
  return Scope::kFunction;
}

// Of a function that begins like this: what commas divide between its first parentheses.
std::size_t parameters_of(const std::string& head) {
  const std::size_t begin = head.find('(');
  if (begin == std::string::npos) return 0;
  std::size_t count = 0;
  int depth = 1;
  bool any = false;
  for (std::size_t i = begin + 1; i < head.size() && depth > 0; ++i) {
    const char c = head[i];
    depth += (c == '(' || c == '<' || c == '[') - (c == ')' || c == '>' || c == ']');
    any = any || (depth > 0 && c != ' ' && c != '\n');
    count += c == ',' && depth == 1;
  }
  return any ? count + 1 : 0;
}

}  // namespace

std::vector<FunctionSize> function_sizes(const SourceFile& file) {
  const std::string text = without_comments_and_literals(file.text);
  std::vector<FunctionSize> sizes;
  // With the line where it opened, and the parameters of a function.
  std::vector<std::tuple<Scope, std::size_t, std::size_t>> open;
  std::string head;
  std::size_t line = 1;
  int parentheses = 0;
  for (const char c : text) {
    if (c == '\n') ++line;
    parentheses += (c == '(') - (c == ')');
    if (c == '{') {
      const Scope outer = open.empty() ? Scope::kNamespace : std::get<Scope>(open.back());
      open.emplace_back(parentheses > 0 ? Scope::kOther : scope_of(head, outer), line,
                        parameters_of(head));
      head.clear();
    } else if (c == '}') {
      if (open.empty()) return sizes;  // not C++ as we write it
      const auto [scope, begin, parameters] = open.back();
      open.pop_back();
      if (scope == Scope::kFunction)
        sizes.push_back({file.path, begin, line - begin + 1, parameters});
      head.clear();
    } else if (c == ';' && parentheses == 0) {
      head.clear();
    } else {
      head += c;
    }
  }
  return sizes;
}

std::vector<Finding> check_function_length(const SourceFile& file, std::size_t limit) {
  std::vector<Finding> findings;
  for (const FunctionSize& function : function_sizes(file)) {
    if (function.lines <= limit) continue;
    findings.push_back({file.path, function.line,
                        "function of " + std::to_string(function.lines) +
                            " lines; allowed: " + std::to_string(limit)});
  }
  return findings;
}

std::vector<Finding> check_parameters(const SourceFile& file, std::size_t limit) {
  std::vector<Finding> findings;
  for (const FunctionSize& function : function_sizes(file)) {
    if (function.parameters <= limit) continue;
    findings.push_back({file.path, function.line,
                        "function of " + std::to_string(function.parameters) +
                            " parameters; allowed: " + std::to_string(limit) +
                            ": what is passed on together is one"});
  }
  return findings;
}

}  // namespace soda::tidy
