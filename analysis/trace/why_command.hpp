// `soda why`: what led to the rollbacks of a run, in plain sentences.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "analysis/trace/execution_trace.hpp"

namespace soda::analysis {

struct WhyRequest {
  std::string file;
  std::optional<std::uint32_t> world;   // only what this world had to do again
  std::optional<std::int64_t> step;     // only what undid something of this step
  std::optional<std::uint32_t> body;    // only what this body had to do with, by label
  std::optional<std::size_t> rollback;  // only this one, from 1
  bool all = false;                     // each rollback, and what would have helped
  bool json = false;
};

// What all rollbacks of one cause cost.
struct CauseCost {
  std::size_t rollbacks = 0, undone = 0, put_back = 0;
  std::int64_t wasted_ns = 0;           // by these rollbacks
  std::int64_t wasted_with_all_ns = 0;  // and by those that followed from them
};

// What a rollback was for, as one of few: "ghosts that touch", "migration", "taken back: ghosts".
std::string cause_of(const ExecutionTrace& trace, RollbackNumber rollback);
std::map<std::string, CauseCost> causes_of(const ExecutionTrace& trace);
// Those that led to `rollback`, itself first.
std::vector<RollbackNumber> chain_of(const ExecutionTrace& trace, RollbackNumber rollback);
// One rollback in sentences; bodies are called by `labels`.
std::string why_text(const ExecutionTrace& trace, RollbackNumber rollback,
                     const std::vector<std::uint32_t>& labels);
// The same of its whole chain.
std::string chain_text(const ExecutionTrace& trace, RollbackNumber rollback,
                       const std::vector<std::uint32_t>& labels);

// Throws FileError and UsageError as read_trace().
int why_command(const WhyRequest& request, std::ostream& out, std::ostream& err);

}  // namespace soda::analysis
