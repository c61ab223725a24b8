#include "scenarios/syntax_fault.hpp"

#include <algorithm>
#include <cctype>

namespace soda::scenarios {
namespace {

struct Hint {
  std::string_view start, text;
};

constexpr Hint kHints[] = {
    {"NaN", "JSON has no NaN"},
    {"nan", "JSON has no NaN"},
    {"Inf", "JSON has no infinity"},
    {"inf", "JSON has no infinity"},
    {"-I", "JSON has no infinity"},
    {"-i", "JSON has no infinity"},
    {"//", "JSON has no comments"},
    {"/*", "JSON has no comments"},
    {"#", "JSON has no comments"},
    {"'", "strings stand in double quotes"},
    {"]", "no comma after the last value"},
    {"}", "no comma after the last member"},
    {"True", "true and false are in lower case"},
    {"False", "true and false are in lower case"},
    {"None", "nothing is written null"},
    {"+", "a number starts with a digit or a minus sign"},
    {".", "a number starts with a digit or a minus sign"},
    {"{", "a comma separates values"},
    {"\"", "a comma separates values, a colon follows a key"},
};

std::string hint_at(std::string_view rest) {
  for (const Hint& hint : kHints) {
    if (rest.substr(0, hint.start.size()) == hint.start) return std::string(hint.text);
  }
  const bool two_digits = rest.size() > 1 && std::isdigit(static_cast<unsigned char>(rest[1]));
  if (rest[0] == '0' && two_digits) return "a number has no leading zeros";
  return "";
}

// The wanted symbol in words. The parser names only one of the symbols that would do.
std::string wanted(const std::string& message) {
  constexpr std::string_view kMark = "; expected ";
  const std::size_t at = message.rfind(kMark);
  if (at == std::string::npos) return "well-formed JSON";
  const std::string symbol = message.substr(at + kMark.size());
  if (symbol == "'}'") return "',' or '}'";
  if (symbol == "']'") return "',' or ']'";
  if (symbol == "string literal") return "a key in double quotes";
  if (symbol == "'[', '{', or a literal") return "a value";
  if (symbol == "end of input") return "nothing after the document";
  return printable(symbol);
}

bool in_word(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '+' || c == '.';
}

// Faults of single bytes, by words of the parser's message.
std::string bad_byte(const std::string& message, std::string_view byte) {
  const auto says = [&](std::string_view word) { return message.find(word) != std::string::npos; };
  if (says("UTF-8")) return "the byte " + printable(byte) + ", which is not UTF-8";
  if (says("control character")) return "the unescaped byte " + printable(byte) + " in a string";
  return "";
}

}  // namespace

SyntaxFault explain_syntax_fault(std::string_view text, std::size_t failed_at,
                                 const std::string& parser_message) {
  SyntaxFault fault{.offset = std::min(failed_at, text.size()), .text = {}};
  fault.text.allowed = wanted(parser_message);
  if (fault.offset == text.size()) {
    const bool blank = text.find_first_not_of(" \t\r\n") == text.npos;
    fault.text.found = blank ? "an empty file" : "the end of the file";
    fault.text.hint = blank ? "" : "the file is cut off";
    return fault;
  }
  fault.text.found = bad_byte(parser_message, text.substr(fault.offset, 1));
  if (!fault.text.found.empty()) return fault;
  // A wrong word fails at the first letter that differs: the word is what a person looks for.
  const bool broken_word = parser_message.find("invalid") != std::string::npos;
  if (broken_word || in_word(text[fault.offset])) {
    while (fault.offset > 0 && in_word(text[fault.offset - 1])) --fault.offset;
  }
  const std::size_t end = text.find_first_of(" \t\r\n,:]}", fault.offset + 1);
  fault.text.found =
      printable(text.substr(fault.offset, std::min(end, text.size()) - fault.offset));
  fault.text.hint = hint_at(text.substr(fault.offset));
  return fault;
}

}  // namespace soda::scenarios
