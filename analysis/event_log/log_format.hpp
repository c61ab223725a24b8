// The event log: block layout and payloads, shared by writer and reader. The format is documented
// in docs/log-format.md.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "analysis/event_log/log_states.hpp"
#include "analysis/runs/overrides.hpp"
#include "analysis/text/byte_codec.hpp"
#include "physics/model/body_state.hpp"
#include "scenarios/mesh_file.hpp"

namespace soda::analysis {

inline constexpr std::array<unsigned char, 8> kLogMagic{'S', 'O', 'D', 'A', 'L', 'O', 'G', 0};
inline constexpr std::uint32_t kLogVersion = 8;

enum class BlockType : std::uint32_t {
  kScenario = 1,  // first block
  kOptions = 2,
  kBodies = 3,
  kMesh = 6,    // one for each mesh file of the scenario
  kStep = 4,    // one for each step, from the first on
  kTrace = 7,   // a chunk of the trace, anywhere after the first step
  kBounds = 8,  // where bodies were since the last such block (motion_bounds.hpp)
  kLast = 9,    // the states of the last step, whole, where its own block has a difference
  kEnd = 5,     // last block of a run that came to its end, or was ended early
};

inline constexpr std::size_t kFileHeaderBytes = 24;   // magic, version, 0, checksum
inline constexpr std::size_t kBlockHeaderBytes = 40;  // the fields below and a checksum of them
// Of all mesh blocks of a log together, before compression.
inline constexpr std::uint64_t kMaxMeshBlocksBytes = std::uint64_t{256} << 20;
// The most that the payload of a block takes before compression; `bodies` of the log. What says
// that it takes more is no log: nothing is decompressed beyond it.
constexpr std::uint64_t max_raw_bytes(BlockType type, std::uint64_t bodies) {
  if (type == BlockType::kScenario)
    return std::uint64_t{257} << 20;                              // its text has 256 MiB at most
  if (type == BlockType::kBodies) return std::uint64_t{4} << 20;  // labels of a million
  if (type == BlockType::kMesh) return scenarios::kMaxMeshBytes + 8192;  // with its name
  if (type == BlockType::kStep || type == BlockType::kLast)
    return (std::uint64_t{64} << 20) + (bodies << 10);
  if (type == BlockType::kBounds) return 4096 + 32 * bodies;
  if (type == BlockType::kTrace) return std::uint64_t{8} << 20;
  return 4096;
}

// States hardly compress, and parts of steps are read by themselves.
constexpr bool is_compressed(BlockType type) {
  return type != BlockType::kStep && type != BlockType::kLast;
}

struct BlockHeader {
  BlockType type{};
  std::uint32_t index = 0;            // 0, 1, ... in the file
  std::uint64_t raw_bytes = 0;        // of the payload before compression
  std::uint64_t stored_bytes = 0;     // of the payload in the file
  std::uint64_t stored_checksum = 0;  // XXH3-64 of the stored bytes
};

struct LoggedScenario {
  std::string program_version;  // of the soda that wrote the log
  std::string file;             // absolute path
  std::string text;
  double dt_s = 0.0;  // its step, from which states are predicted
};

// How much of a run a log holds. What it needs to be run again is always there.
enum class LogLevel : std::uint8_t {
  kInputs,   // of a step its digest, and what came from outside
  kCommits,  // also the committed states
  kTrace,    // also the life of every event
};
inline constexpr std::array kLogLevels{"inputs", "commits", "trace"};  // by LogLevel

struct LoggedOptions {
  Overrides overrides;      // but the transport
  std::uint32_t ranks = 0;  // of the job; 0: mpirun did not start it
  LogLevel level = LogLevel::kCommits;
  std::int64_t every = 1;  // states of every so many steps, from the first on; >= 1
  // Before which the run begins: 0, or that of the checkpoint from which it goes on.
  std::int64_t first_step = 0;
};

// Whether the log has the states of a step: a run that goes on begins with some.
inline bool has_states(const LoggedOptions& options, std::int64_t step) {
  const std::int64_t since = step - options.first_step;
  if (since == 0 && step > 0) return true;
  return options.level != LogLevel::kInputs && since % options.every == 0;
}

// An option by name and value, as a user reads it.
struct OptionText {
  std::string name, value;
};
// All of them, each in its place.
std::vector<OptionText> in_words(const LoggedOptions& options);  // log_options.cpp

// Every so many states are written whole, the others as what has changed since the states before.
inline constexpr std::int64_t kStatesAWhole = 128;
inline bool is_whole(const LoggedOptions& options, std::int64_t step) {
  return (step - options.first_step) / options.every % kStatesAWhole == 0;
}

struct LoggedStep {
  std::int64_t step = 0;
  std::uint64_t digest = 0;
  bool has_states = true;                  // else ids and states are empty
  std::vector<physics::BodyId> ids;        // of the bodies that are there; ascending
  std::vector<physics::BodyState> states;  // of ids
  // Of the beginning of the step that led here; of the first step, all that acted before it, and in
  // a checkpoint what is known to come.
  std::vector<models::CommittedInput> inputs;
  std::vector<models::TerritoryChange> territory_changes;
};

// What stands before the states of a step.
struct StepHead {
  std::int64_t step = 0;
  std::uint64_t digest = 0;
  bool has_states = false;
  bool is_whole = false;  // the states; else they are a difference
  std::vector<models::CommittedInput> inputs;
  std::vector<models::TerritoryChange> territory_changes;
};

// Of a run that was ended as it should be, if early: then `steps` is less than was asked for.
struct LoggedEnd {
  std::int64_t steps = 0;
  std::uint64_t digest = 0;                       // after the last of them
  std::optional<std::uint64_t> execution_digest;  // of a virtual cluster, where it can be had again
};

std::uint64_t checksum(std::span<const unsigned char> bytes);

ByteBuffer encode_file_header();
ByteBuffer encode(const BlockHeader& header);
ByteBuffer encode(const LoggedScenario& scenario);
ByteBuffer encode(const LoggedOptions& options);  // log_options.cpp
ByteBuffer encode(const scenarios::MeshFile& mesh);
ByteBuffer encode_labels(std::span<const std::uint32_t> labels);
// `before`: the states before, to write what has changed since; null: they are written whole.
ByteBuffer encode_step(const LoggedStep& step, const LoggedStates* before = nullptr,
                       double between_s = 0.0);
ByteBuffer encode(const LoggedEnd& end);

// Each throws DecodeError if the bytes are not what encode makes, or hold a value that no run can
// have: kinds, flags and counts are checked, ids of a step (ascending; below `bodies`) with its
// inputs, which are finite. The two headers also check their checksum.
void decode_file_header(std::span<const unsigned char> bytes);
BlockHeader decode_block_header(std::span<const unsigned char> bytes);
LoggedScenario decode_scenario(std::span<const unsigned char> bytes);
LoggedOptions decode_options(std::span<const unsigned char> bytes);  // log_options.cpp
scenarios::MeshFile decode_mesh(std::span<const unsigned char> bytes);
std::vector<std::uint32_t> decode_labels(std::span<const unsigned char> bytes);
struct StepInLog {
  std::size_t bodies = 0;  // of the log
  bool is_first = false;   // of the log, and not step 0
};
LoggedStep decode_step(std::span<const unsigned char> bytes, const StepInLog& in_log,
                       const LoggedStates* before = nullptr, double between_s = 0.0);
// How long the parts of a step are that stand before the records of its states, by what it begins
// with: its head, and what decode_difference_head() takes.
inline constexpr std::size_t kStepHeadBytes = 8 + 8 + 1 + 8 + 8;
struct StepParts {
  std::uint64_t head_bytes = 0, index_bytes = 0;
};
StepParts step_parts(std::span<const unsigned char> beginning);
// Behind it stand the states (log_states.hpp).
StepHead decode_step_head(ByteReader& in, const StepInLog& in_log);
LoggedEnd decode_end(std::span<const unsigned char> bytes);

}  // namespace soda::analysis
