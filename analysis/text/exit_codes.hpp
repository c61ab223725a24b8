// Exit codes of `soda`, and the errors that lead to them. Input and file errors are those of
// scenarios/read_scenario.hpp.
#pragma once

#include <stdexcept>
#include <string>

namespace soda::analysis {

inline constexpr int kExitOk = 0;
inline constexpr int kExitCheckFailed = 1;  // the program worked, and what it checked is not so
inline constexpr int kExitInput = 2;        // command line or scenario
inline constexpr int kExitFile = 3;  // not opened, read or written; no log; no memory, no threads
inline constexpr int kExitNumerical = 4;  // a fault was committed: see NumericalFailure
inline constexpr int kExitInternal = 70;  // a defect of soda
inline constexpr int kExitSignal = 128;   // and the number of the signal that ended a run early

// The command line asks for something that does not exist or does not fit. Exit code 2.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// What was to be checked is not so, and there is nothing else to report. Exit code 1.
class CheckFailed : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// The committed trajectory ends in a state that is no number: names step, world and body.
// Exit code 4.
class NumericalFailure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// There is not enough memory for what was asked for, which it names. Exit code 3.
class OutOfMemory : public std::runtime_error {
 public:
  explicit OutOfMemory(const std::string& what_for)
      : std::runtime_error("not enough memory for " + what_for) {}
};

}  // namespace soda::analysis
