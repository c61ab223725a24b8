// Reading an event log.
#pragma once

#include <cstdint>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "analysis/event_log/file_bytes.hpp"
#include "analysis/event_log/log_format.hpp"
#include "analysis/event_log/motion_bounds.hpp"
#include "kernel/api/payload.hpp"

namespace soda::analysis {

// Opening scans the whole file and checks every checksum; steps are decoded when asked for, so
// memory does not grow with what a log holds.
class LogReader {
 public:
  // Throws FileError if `file` cannot be read, is no regular file, no log of this version, is cut
  // off or damaged before its first step is whole, or has an end that is not that of its steps.
  explicit LogReader(const std::string& file);

  const std::string& file() const { return file_; }
  // Of a step, in words: number and offset of its block.
  std::string place_of(std::int64_t step) const;

  const LoggedScenario& scenario() const { return scenario_; }
  const LoggedOptions& options() const { return options_; }
  const std::vector<scenarios::MeshFile>& meshes() const { return meshes_; }
  const std::vector<std::uint32_t>& labels() const { return labels_; }
  // The step with which the log begins.
  std::int64_t first_step() const { return options_.first_step; }
  // The last step whose block is whole and sound; all before it are too.
  std::int64_t last_step() const {
    return first_step() + static_cast<std::int64_t>(step_blocks_.size()) - 1;
  }
  // Whether the log ends with its end block.
  bool complete() const { return complete_; }
  // Of a virtual cluster; nothing if it was none, or the log is not complete.
  std::optional<std::uint64_t> execution_digest() const { return execution_digest_; }
  // Where and how the log is cut off; empty if it is not.
  const std::string& cut() const { return cut_; }
  // The first block whose bytes are not what was written, with its step; empty if all are sound.
  // What follows it is not read.
  const std::string& damage() const { return damage_; }

  // How many blocks of trace there are; and one of them, for kernel::TraceChunk. Throws FileError
  // as read_step().
  std::size_t traces() const { return trace_blocks_.size(); }
  kernel::Bytes read_trace(std::size_t index);

  // The last step whose states the log has; throws UsageError if it has none.
  std::int64_t last_states() const;
  // first_step() <= step <= last_step(). Every id in it is below labels().size(). Throws FileError,
  // with block and offset, if what the block holds, though undamaged, is no such step: no soda
  // wrote it.
  LoggedStep read_step(std::int64_t step);
  // The same of a step with states; throws UsageError if it has none.
  LoggedStep read_states(std::int64_t step);
  // The same but for states, which are neither read nor checked.
  StepHead read_head(std::int64_t step);
  // The states of last_step(), which has some; sooner than by the differences that lead there.
  LoggedStates read_last_states();
  // first_step() <= step < last_step(): of the steps from it on; none if the log has none of them.
  std::optional<MotionBounds> read_bounds(std::int64_t step);
  StepParts step_parts_of(std::int64_t step);
  // `count` bytes of a step's block, from `begin` on, as decode_step() takes them.
  FileBytes read_part(std::int64_t step, std::uint64_t begin, std::uint64_t count);
  // Between states that follow each other.
  double between_s() const { return scenario_.dt_s * static_cast<double>(options_.every); }
  // Throws FileError: what is wrong with a step.
  [[noreturn]] void refuse(std::int64_t step, const std::string& why) const;

 private:
  struct Block {
    BlockHeader header;
    FileBytes stored;
  };
  // Where a block begins, its number in the file, and how long its payload is there.
  struct Place {
    std::uint32_t block = 0;
    std::streamoff offset = 0;
    std::uint64_t bytes = 0;
  };
  enum class Next { kBlock, kEnd };

  Next next_block(Block& block);
  bool keep(const Block& block, std::streamoff offset);
  bool type_fits(std::uint32_t index, BlockType type) const;
  const Place& block_of(std::int64_t step) const {
    return step_blocks_[static_cast<std::size_t>(step - first_step())];
  }
  FileBytes read_again(const Place& at);
  LoggedStep read_after_last(std::int64_t step);
  StepInLog in_log(std::int64_t step) const {
    return {labels_.size(), step == first_step() && step > 0};
  }
  void check_head(std::int64_t step, const StepHead& head) const;
  void check_end(const Block& block, std::streamoff offset);
  // Of the block that comes next.
  std::string place(std::streamoff offset) const;

  std::string file_;
  std::ifstream in_;
  std::uint64_t file_bytes_ = 0;
  LoggedScenario scenario_;
  LoggedOptions options_;
  std::vector<scenarios::MeshFile> meshes_;
  std::uint64_t left_for_meshes_ = kMaxMeshBlocksBytes;
  std::vector<std::uint32_t> labels_;
  std::vector<Place> step_blocks_, trace_blocks_, bounds_blocks_;
  std::optional<Place> last_block_;
  LoggedStates last_;  // that were read, of last_read_
  std::int64_t last_read_ = -1;
  std::uint32_t blocks_ = 0;
  bool complete_ = false;
  std::optional<std::uint64_t> execution_digest_;
  std::string cut_, damage_;
};

}  // namespace soda::analysis
