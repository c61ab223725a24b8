// What the library throws.
#pragma once

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "soda/export.hpp"

namespace soda {

// One thing wrong with a scene or an input, where it stands in the text.
struct SceneFault {
  std::size_t line = 0, column = 0;  // from 1; 0: it is of the text as a whole
  std::string pointer;               // JSON pointer, e.g. /bodies/3/mass_kg
  std::string found, allowed, hint;
};

// A scene or an input that says what it may not. what() has a line for each fault, as `soda run`
// prints them. Of a scene that was built (soda/scene.hpp) the places are those in its scene_text().
class SODA_API SceneError : public std::runtime_error {
 public:
  SceneError(const std::string& message, std::vector<SceneFault> faults);
  ~SceneError() override;
  const std::vector<SceneFault>& faults() const { return faults_; }

 private:
  std::vector<SceneFault> faults_;
};

// A file that cannot be read.
class SODA_API FileError : public std::runtime_error {
 public:
  explicit FileError(const std::string& message);
  ~FileError() override;
};

// A call that does not fit the simulation: an unknown body, a step that has passed, a snapshot of
// another scene.
class SODA_API UsageError : public std::invalid_argument {
 public:
  explicit UsageError(const std::string& message);
  ~UsageError() override;
};

// A body whose state would not be finite any more. The simulation stands before the end of that
// step and goes on from a snapshot only.
class SODA_API NumericalError : public std::runtime_error {
 public:
  NumericalError(std::int64_t step, std::uint32_t body, const std::string& what);
  ~NumericalError() override;
  std::int64_t step() const { return step_; }   // that begins after so many steps
  std::uint32_t body() const { return body_; }  // its id

 private:
  std::int64_t step_;
  std::uint32_t body_;
};

}  // namespace soda
