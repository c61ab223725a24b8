// Reading scenario files: strict, and listing every fault of a file at once.
#pragma once

#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "scenarios/mesh_file.hpp"
#include "scenarios/scenario.hpp"

namespace soda::scenarios {

// One thing wrong with a file.
struct InputFault {
  std::size_t line = 0, column = 0;  // 1-based; 0 if the fault is the file's as a whole
  std::string pointer;               // JSON pointer, e.g. /bodies/3/mass_kg; "" is the document
  std::string found;                 // what stands there
  std::string allowed;               // what may stand there
  std::string hint;                  // nearest known name, or what to do; may be empty
};

// All faults of one file, in the order of their place. what() is the whole message, a line a fault:
// "FILE:LINE:COLUMN: POINTER: found F; allowed: A (did you mean ...?)".
class InputError : public std::runtime_error {
 public:
  InputError(const std::string& file, std::vector<InputFault> faults);
  const std::vector<InputFault>& faults() const { return faults_; }

 private:
  std::vector<InputFault> faults_;
};

// The file cannot be opened, read or written (missing, a directory or device, no permission, a full
// disk), or there is not enough memory for what is in it: exit code 3.
class FileError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// The text of a scenario, or of another input: of a regular file of at most 256 MiB. Throws
// InputError if it is larger, FileError if it cannot be read.
std::string read_text(const std::string& file);

// Reads a scenario, with warnings of what it hardly means. `file` names it in messages; mesh files
// are looked up relative to its folder, unless `files` holds them. `seed`, if given, replaces every
// seed in the file (generators, territory map). Throws InputError or FileError; nothing else,
// whatever the bytes.
Scenario read_scenario_file(const std::string& file, std::optional<std::uint64_t> seed = {});
Scenario read_scenario_text(std::string_view text, const std::string& file,
                            std::optional<std::uint64_t> seed = {}, const MeshFiles& files = {},
                            ScenarioExtent extent = ScenarioExtent::kAll);

// The JSON Schema (draft-07) of the format, made from the reader's own field table.
std::string scenario_schema();

}  // namespace soda::scenarios
