// User input from a file, or from a stream while the run goes on.
#pragma once

#include <cstddef>
#include <iosfwd>
#include <memory>
#include <string>
#include <thread>

#include "models/user_input/input_feed.hpp"
#include "scenarios/inputs.hpp"
#include "scenarios/scenario.hpp"

namespace soda::analysis {

// Reads lines in a thread of its own and offers them to the run. A line that cannot be understood
// is told to `err` and left out; one that does not end within 1 MiB ends the stream.
class InputStream {
 public:
  // Takes over the file descriptor. `scenario` and `err` must outlive this object.
  InputStream(int descriptor, std::string name, const scenarios::Scenario& scenario,
              std::ostream& err);
  ~InputStream();
  InputStream(const InputStream&) = delete;
  InputStream& operator=(const InputStream&) = delete;

  // Where the run takes them from.
  models::LiveInputs& inputs() { return inputs_; }

  void start();
  // Reads no more. How many lines were left out.
  std::size_t stop();

 private:
  void read(const std::stop_token& stop);
  void take(std::string_view line);
  void refuse(const std::string& what);

  const int descriptor_;
  std::ostream& err_;
  scenarios::InputLines lines_;
  models::LiveInputs inputs_;
  std::size_t bad_lines_ = 0;
  std::jthread reader_;
};

// `from`: empty for none, "-" for standard input, else a file. A regular file is read at once, and
// its inputs are those of the scenario; anything else becomes a stream, to which `scenario` is
// connected. Throws InputError and FileError.
std::unique_ptr<InputStream> open_inputs(const std::string& from, scenarios::Scenario& scenario,
                                         std::ostream& err);

}  // namespace soda::analysis
