// `soda branch`: another future from a committed step, and how far it is from the recorded one.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "analysis/branch/branch_difference.hpp"

namespace soda::analysis {

struct BranchRequest {
  std::string file;
  std::int64_t step = 0;              // before which the new inputs begin to act
  std::string inputs;                 // a file of lines; none acts before `step`
  std::optional<std::int64_t> steps;  // after which it ends; without: as far as the log goes
  std::string log_file;               // empty: none
  bool force = false;                 // replaces that
  bool json = false;
  bool quiet = false;
};

struct BranchReport {
  std::int64_t first_step = 0, steps = 0;  // made from the one to the other
  std::size_t inputs = 0;                  // new ones
  std::uint64_t body_steps = 0;            // bodies computed, over all steps
  std::uint64_t digest = 0;                // after the last step
  std::uint32_t stopped = 0;               // the request that ended it early; 0: none did
  std::vector<StepDifference> differences;
};

// The branch goes on from the states of `step`, and inputs of the log that act later act in it too.
// Without a log of its own, only the bodies are computed that the new inputs make a difference to
// (cone.hpp), as long as these are few; else all of them, with one world in one thread.
// kExitCheckFailed if the log is damaged. Throws UsageError for a step whose states the log has
// not, for inputs before it and for ids that the log has used.
int branch_command(const BranchRequest& request, std::ostream& out, std::ostream& err);

}  // namespace soda::analysis
