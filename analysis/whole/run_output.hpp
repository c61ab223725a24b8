// What `soda run --json --step-digests` printed.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace soda::analysis {

struct RunOutput {
  std::vector<std::string> step_digests;  // [k] after step k + 1
  std::string digest;
  std::uint64_t events = 0, rolled_back = 0, rollbacks = 0, migrations = 0;
};

// Null if the text is no such object.
std::optional<RunOutput> parse_run_output(const std::string& text);

// "step K, world W, body B: WHAT" in a message.
struct ToldFault {
  std::int64_t step = 0;
  std::uint64_t body = 0;
};
std::optional<ToldFault> find_fault(const std::string& text);

}  // namespace soda::analysis
