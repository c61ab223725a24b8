#include "analysis/text/shell_words.hpp"

#include <string_view>

namespace soda::analysis {
namespace {

bool is_plain(const std::string& word) {
  constexpr std::string_view kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_=+,.:/@%";
  return !word.empty() && word.find_first_not_of(kPlain) == std::string::npos;
}

std::string in_quotes(const std::string& word) {
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

}  // namespace

std::string as_typed(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words)
    text += (text.empty() ? "" : " ") + (is_plain(word) ? word : in_quotes(word));
  return text;
}

}  // namespace soda::analysis
