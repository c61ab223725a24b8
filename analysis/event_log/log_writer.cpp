#include "analysis/event_log/log_writer.hpp"

#include <zstd.h>

#include <new>
#include <utility>

#include "physics/measures/measures.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::analysis {
namespace {

// The lowest level: random low bits of doubles hardly compress further at higher ones.
constexpr int kCompressionLevel = -5;

ByteBuffer compress(std::span<const unsigned char> raw) {
  ByteBuffer stored(ZSTD_compressBound(raw.size()));
  const std::size_t size =
      ZSTD_compress(stored.data(), stored.size(), raw.data(), raw.size(), kCompressionLevel);
  if (ZSTD_isError(size)) throw std::bad_alloc();  // nothing else can fail in it
  stored.resize(size);
  return stored;
}

}  // namespace

LogWriter::LogWriter(const std::string& file, bool replaces, Use use)
    : use_(use), out_(file, replaces) {}

void LogWriter::begin(const LoggedScenario& scenario, const LoggedOptions& options,
                      std::span<const std::uint32_t> labels,
                      std::span<const scenarios::MeshFile> meshes) {
  bodies_ = labels.size();
  options_ = options;
  between_s_ = scenario.dt_s * static_cast<double>(options.every);
  out_.write(encode_file_header());
  write_block(BlockType::kScenario, encode(scenario));
  write_block(BlockType::kOptions, encode(options));
  write_block(BlockType::kBodies, encode_labels(labels));
  std::uint64_t left = kMaxMeshBlocksBytes;
  for (const scenarios::MeshFile& mesh : meshes) {
    const ByteBuffer payload = encode(mesh);
    if (payload.size() > left)
      throw scenarios::FileError(out_.file() + ": the scenario's mesh files are too large; a log " +
                                 "has at most 256 MiB of them");
    left -= payload.size();
    write_block(BlockType::kMesh, payload);
  }
}

bool LogWriter::add_step(LoggedStep step) {
  return add([&] {
    const bool whole = !step.has_states || is_whole(options_, step.step);
    write_block(BlockType::kStep, encode_step(step, whole ? nullptr : &last_, between_s_));
    if (step.has_states) last_ = {std::move(step.ids), std::move(step.states)};
    end_.steps = step.step;
    end_.digest = step.digest;
  });
}

bool LogWriter::add_committed(const models::CommittedStep& step) {
  LoggedStep logged{
      .step = step.step,
      .digest = physics::digest(step.ids, step.states),
      .has_states = has_states(options_, step.step),
      .ids = {},
      .states = {},
      .inputs = {step.inputs.begin(), step.inputs.end()},
      .territory_changes = {step.territory_changes.begin(), step.territory_changes.end()}};
  if (logged.has_states) {
    logged.ids.assign(step.ids.begin(), step.ids.end());
    logged.states.assign(step.states.begin(), step.states.end());
  }
  return add_step(std::move(logged));
}

bool LogWriter::add_trace(std::span<const std::byte> chunk) {
  return add([&] {
    write_block(BlockType::kTrace,
                {reinterpret_cast<const unsigned char*>(chunk.data()), chunk.size()});
  });
}

template <class Write>
bool LogWriter::add(Write write) {
  const std::lock_guard lock(mutex_);
  if (!failure_.empty()) return false;
  try {
    write();
    if (use_ == Use::kLog) out_.keep();
  } catch (const scenarios::FileError& error) {
    failure_ = error.what();
  } catch (const std::bad_alloc&) {
    failure_ = out_.file() + ": no memory is left to write the log";
  }
  return failure_.empty();
}

void LogWriter::finish() {
  try {
    if (!failure_.empty()) throw scenarios::FileError(failure_);
    write_block(BlockType::kEnd, encode(end_));
  } catch (const scenarios::FileError& error) {
    if (use_ == Use::kCheckpoint) throw;
    throw scenarios::FileError(std::string(error.what()) + "; " + out_.partial_file() +
                               " holds the log up to step " + std::to_string(end_.steps));
  }
  if (use_ == Use::kCheckpoint) out_.put_on_disk();
  out_.complete();
}

void LogWriter::write_block(BlockType type, std::span<const unsigned char> payload) {
  if (payload.size() > max_raw_bytes(type, bodies_))
    throw scenarios::FileError(out_.file() + ": a block of " + std::to_string(payload.size()) +
                               " bytes; a log has blocks of at most " +
                               std::to_string(max_raw_bytes(type, bodies_)));
  const ByteBuffer stored = compress(payload);
  ByteBuffer block =
      encode(BlockHeader{type, next_index_++, payload.size(), stored.size(), checksum(stored)});
  block.insert(block.end(), stored.begin(), stored.end());
  out_.write(block);
}

}  // namespace soda::analysis
