// Commands that a page quotes, with what they print.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace soda::readme {

// An indented line that starts with `$ `, and the indented lines under it up to the next command or
// the end of the block.
struct Quote {
  std::size_t line = 0;   // 1-based, of the command
  std::size_t first = 0;  // index of the first line of output
  std::string command;
  std::vector<std::string> output;  // without the indentation
  bool cut = false;                 // ends with `...`: what is printed after that is left out
  bool starts_block = false;        // a new folder, without the files of the quotes before
};

std::vector<Quote> quotes_of(const std::vector<std::string>& readme_lines);

// A page that says so in a comment is read from its top: its blocks see the files of those before.
bool shares_folder(const std::vector<std::string>& lines);

// `cat FILE` quotes what stands in a file: it is written, not run.
bool is_file(const Quote& quote);

// What does not depend on time or schedule: figures of README ("Quoted output") become `~`, runs of
// spaces and of dashes become one.
std::string masked(const std::string& line);

// The first lines that differ when masked, as text; empty if none do.
std::string difference(const Quote& quote, const std::vector<std::string>& printed);

// The README with the lines of `printed` (by quote) that differ when masked.
std::string rewritten(std::vector<std::string> lines, const std::vector<Quote>& quotes,
                      const std::vector<std::vector<std::string>>& printed);

std::vector<std::string> lines_of(const std::string& text);

}  // namespace soda::readme
