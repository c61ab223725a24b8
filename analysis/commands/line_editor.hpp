// Lines of standard input: on a terminal with a prompt, completion and history, where the library
// for that was there when soda was built; else as they come. Only who edits lines loads the
// library.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace soda::analysis {

class LineEditor {
 public:
  virtual ~LineEditor() = default;
  // Without its end; nothing at the end of the input.
  virtual std::optional<std::string> next() = 0;
  // Whether somebody types the lines.
  virtual bool is_on_terminal() const = 0;
};

// What can stand for the last word of a line, which may be empty.
using Completions = std::function<std::vector<std::string>(const std::string& line)>;

std::unique_ptr<LineEditor> edit_lines(const std::string& prompt, Completions completions);

// What the module soda_lines.so exports under kEditLinesSymbol; the caller owns what it returns.
using EditLines = LineEditor*(const std::string& prompt, Completions completions);
inline constexpr const char* kEditLinesSymbol = "soda_edit_lines";

}  // namespace soda::analysis
