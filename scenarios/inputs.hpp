// User input as a scenario or a line gives it, made into what worlds understand.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "models/user_input/user_input.hpp"
#include "scenarios/document.hpp"
#include "scenarios/faults.hpp"

namespace soda::scenarios {

struct Scenario;

// Turns the inputs of one run into UserInputs. What it refers to must outlive it.
class InputBuilder {
 public:
  // Of a scenario with all its bodies and joints.
  explicit InputBuilder(const Scenario& scenario) : scenario_(scenario) {}

  // Nothing, and faults, if the body or joint is unknown, the id was used before, or the time is
  // not a whole number of steps. Without a time the step is -1.
  std::optional<models::UserInput> build(const InputSpec& spec, FaultList& faults);
  // Ids that are taken already.
  void take_id(std::uint32_t id, std::string_view where) { ids_.try_emplace(id, where); }

 private:
  bool check_id(const InputBase& base, FaultList& faults);
  bool fill(const BodyInputBase& base, const InputSpec& spec, models::UserInput& input,
            FaultList& faults) const;
  bool fill(const SetMotorSpec& spec, models::UserInput& input, FaultList& faults) const;
  std::optional<std::uint32_t> body_of(const BodyInputBase& base, FaultList& faults) const;
  std::optional<std::int64_t> step_of(const InputBase& base, FaultList& faults) const;

  const Scenario& scenario_;
  std::map<std::uint32_t, std::string> ids_;  // with the place of the first use
};

// One input as a line of JSON, whatever ids others have; without a time its step is -1. `file`
// names it in messages. Throws InputError with all its faults.
models::UserInput read_input_line(const Scenario& scenario, std::string_view line,
                                  const std::string& file);

// Reads inputs as lines of JSON, one object a line, as in the array "inputs" of a scenario; a line
// may lack a time. Empty lines say nothing.
class InputLines {
 public:
  // `file` names the stream in messages. `scenario` must outlive this object.
  InputLines(const Scenario& scenario, std::string file);

  // The next line. Nothing for an empty one. Throws InputError with all faults of the line.
  std::optional<models::UserInput> read(std::string_view line);
  // All lines of a text; what has no time acts at step 0. Throws InputError with all faults.
  std::vector<models::UserInput> read_all(std::string_view text);

 private:
  std::optional<models::UserInput> read_line(std::string_view line, FaultList& faults);

  InputBuilder builder_;
  const std::string file_;
  std::size_t line_ = 0;
};

}  // namespace soda::scenarios
