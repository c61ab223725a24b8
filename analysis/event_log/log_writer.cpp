#include "analysis/event_log/log_writer.hpp"

#include <zstd.h>

#include <algorithm>
#include <new>
#include <utility>

#include "physics/measures/measures.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::analysis {
namespace {

// Random low bits of doubles hardly compress further at higher levels; and what is alike in fewer
// bytes saves less than it costs to find.
constexpr int kCompressionLevel = -9, kLeastMatch = 7;
// Bytes a body from which states are compressed all the same: many contacts. Else parts are read.
constexpr std::size_t kLargeStates = 100;

void refuse_error(std::size_t code) {
  if (ZSTD_isError(code)) throw std::bad_alloc();  // nothing else can fail in it
}

std::unique_ptr<ZSTD_CCtx, void (*)(ZSTD_CCtx*)> make_compressor() {
  std::unique_ptr<ZSTD_CCtx, void (*)(ZSTD_CCtx*)> compressor(
      ZSTD_createCCtx(), [](ZSTD_CCtx* context) { ZSTD_freeCCtx(context); });
  if (!compressor) throw std::bad_alloc();
  refuse_error(
      ZSTD_CCtx_setParameter(compressor.get(), ZSTD_c_compressionLevel, kCompressionLevel));
  refuse_error(ZSTD_CCtx_setParameter(compressor.get(), ZSTD_c_minMatch, kLeastMatch));
  return compressor;
}

// Behind what `block` begins with; what it had there is lost. How many bytes that are.
std::size_t compress_behind(std::size_t begin, std::span<const unsigned char> raw,
                            ZSTD_CCtx* compressor, ByteBuffer& block) {
  const std::size_t most = begin + ZSTD_compressBound(raw.size());
  if (block.size() < most) block.resize(most);
  const std::size_t size = ZSTD_compress2(compressor, block.data() + begin, block.size() - begin,
                                          raw.data(), raw.size());
  refuse_error(size);
  return size;
}

}  // namespace

LogWriter::LogWriter(const std::string& file, bool replaces, Use use)
    : use_(use), out_(file, replaces), compressor_(make_compressor()) {}

void LogWriter::begin(const LoggedScenario& scenario, const LoggedOptions& options,
                      std::span<const std::uint32_t> labels,
                      std::span<const scenarios::MeshFile> meshes) {
  bodies_ = labels.size();
  options_ = options;
  between_s_ = scenario.dt_s * static_cast<double>(options.every);
  if (is_indexed()) bounds_.begin(labels.size(), scenario.dt_s);
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
  block_ = {};  // it has been as large as these
}

bool LogWriter::add_step(LoggedStep step) { return write(step); }

bool LogWriter::write(LoggedStep& step) {
  return add([&] {
    const bool whole = !step.has_states || is_whole(options_, step.step);
    write_block(BlockType::kStep, encode_step(step, whole ? nullptr : &last_, between_s_));
    if (step.has_states) {
      last_.ids.swap(step.ids);
      last_.states.swap(step.states);
      if (is_indexed()) note_bounds(step.step);
    }
    end_.steps = step.step;
    end_.digest = step.digest;
  });
}

// Those of the step are in last_.
void LogWriter::note_bounds(std::int64_t step) {
  bounds_.add(step, last_.ids, last_.states);
  if (step == options_.first_step || (step - options_.first_step) % kBoundedSteps != 0) return;
  write_block(BlockType::kBounds, bounds_.encoded());
  bounds_.restart();
  bounds_.add(step, last_.ids, last_.states);
}

bool LogWriter::add_committed(const models::CommittedStep& step) {
  next_.step = step.step;
  next_.digest = physics::digest(step.ids, step.states);
  next_.has_states = has_states(options_, step.step);
  next_.ids.clear();
  if (next_.has_states) {
    next_.ids.assign(step.ids.begin(), step.ids.end());
    next_.states.assign(step.states.begin(), step.states.end());
  }
  next_.inputs.assign(step.inputs.begin(), step.inputs.end());
  next_.territory_changes.assign(step.territory_changes.begin(), step.territory_changes.end());
  return write(next_);
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
    if (is_indexed() && bounds_.any()) write_block(BlockType::kBounds, bounds_.encoded());
    if (is_indexed() && !last_.ids.empty() && !is_whole(options_, end_.steps))
      write_block(BlockType::kLast, encode(last_));
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
  std::size_t size = payload.size();
  bool as_it_is = !is_compressed(type);
  if (!as_it_is || size > kLargeStates * (bodies_ + 64)) {
    size = compress_behind(kBlockHeaderBytes, payload, compressor_.get(), block_);
    as_it_is = as_it_is && size > payload.size() / 8 * 7;
  }
  if (as_it_is) {
    size = payload.size();
    block_.resize(std::max(block_.size(), kBlockHeaderBytes + size));
    std::ranges::copy(payload, block_.begin() + kBlockHeaderBytes);
  }
  const std::span<const unsigned char> block(block_.data(), kBlockHeaderBytes + size);
  const std::uint64_t sum = checksum(block.subspan(kBlockHeaderBytes));
  std::ranges::copy(encode(BlockHeader{type, next_index_++, payload.size(), size, sum}),
                    block_.begin());
  out_.write(block);
}

}  // namespace soda::analysis
