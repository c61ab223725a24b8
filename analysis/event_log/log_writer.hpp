// Writing an event log.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <string>

#include "analysis/event_log/log_format.hpp"
#include "analysis/event_log/motion_bounds.hpp"
#include "analysis/text/output_file.hpp"
#include "models/commit/commit.hpp"

struct ZSTD_CCtx_s;

namespace soda::analysis {

// Every block goes straight to the file, which has its partial name (OutputFile) until finish(): a
// run that is killed leaves it there, readable up to its last whole block. Steps and traces may be
// added by several threads at once, all else by one.
class LogWriter {
 public:
  // What is left of a log that does not come to its end is of use; of a checkpoint it is not, and
  // the whole one must outlast a crash.
  enum class Use { kLog, kCheckpoint };
  // Throws FileError; see OutputFile.
  LogWriter(const std::string& file, bool replaces, Use use = Use::kLog);

  // Before the first step. Throws FileError.
  void begin(const LoggedScenario& scenario, const LoggedOptions& options,
             std::span<const std::uint32_t> labels, std::span<const scenarios::MeshFile> meshes);
  // Steps from the first one on, in order. False if that fails, now or before: then the log holds
  // the steps so far and takes no more. Does not throw, as it is called from worker threads.
  bool add_step(LoggedStep step);
  // The same of a step as it was committed, with states where the log is to have them.
  bool add_committed(const models::CommittedStep& step);
  // A chunk of the trace; the same.
  bool add_trace(std::span<const std::byte> chunk);
  // The whole run's, for the end block.
  void set_execution(std::uint64_t digest) { end_.execution_digest = digest; }
  // Writes the end block and gives the log its name. Throws FileError if that fails, or add_step()
  // did: the partial file stays, and is named.
  void finish();

 private:
  template <class Write>
  bool add(Write write);
  bool write(LoggedStep& step);
  // Of what is read by parts: of logs that have the states of each step.
  bool is_indexed() const { return options_.level != LogLevel::kInputs && options_.every == 1; }
  void note_bounds(std::int64_t step);
  void write_block(BlockType type, std::span<const unsigned char> payload);

  const Use use_;
  std::mutex mutex_;
  OutputFile out_;
  std::uint64_t bodies_ = 0;
  LoggedOptions options_;
  double between_s_ = 0.0;  // states that are written
  LoggedStates last_;       // that were written
  GatheredBounds bounds_;
  // Memory that is kept from step to step.
  LoggedStep next_;
  ByteBuffer block_;
  std::unique_ptr<ZSTD_CCtx_s, void (*)(ZSTD_CCtx_s*)> compressor_;
  std::uint32_t next_index_ = 0;
  LoggedEnd end_;  // of what has been written
  std::string failure_;
};

}  // namespace soda::analysis
