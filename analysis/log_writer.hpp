// Writing an event log, block by block as steps are committed.
#pragma once

#include <cstdint>
#include <fstream>
#include <span>
#include <string>

#include "analysis/log_format.hpp"

namespace soda::analysis {

// Writes straight into the file and flushes every block: a run that is killed leaves a log that is
// readable up to its last whole block. Used by one thread at a time.
class LogWriter {
 public:
  // Creates or replaces `file`. Throws FileError.
  explicit LogWriter(const std::string& file);

  // Before the first step. Throws FileError.
  void begin(const LoggedScenario& scenario, const Overrides& overrides,
             std::span<const std::uint32_t> labels);
  // Steps 0, 1, 2, ... in order. Does not throw, as it is called from worker threads: a failed
  // write is remembered for finish().
  void add_step(const LoggedStep& step);
  // Writes the end block and closes. Throws FileError if any write failed.
  void finish(std::int64_t steps, std::uint64_t digest);

 private:
  void write_block(BlockType type, std::span<const unsigned char> payload);
  void check() const;

  std::string file_;
  std::ofstream out_;
  std::uint32_t next_index_ = 0;
};

}  // namespace soda::analysis
