#include "analysis/event_log/log_reader.hpp"

#include <zstd.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <new>

#include "analysis/text/exit_codes.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::analysis {
namespace {

constexpr std::uint32_t kBlocksBeforeMeshes = 3;

// States are compressed only where they get smaller by it.
bool stands_as_it_is(const BlockHeader& header) {
  return !is_compressed(header.type) && header.stored_bytes == header.raw_bytes;
}

bool read_bytes(std::ifstream& in, std::size_t count, FileBytes& bytes) {
  bytes.resize(count);
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(count));
  return static_cast<std::size_t>(in.gcount()) == count;
}

// Takes no more memory than there really is to be had, whatever the header says.
FileBytes decompressed(const BlockHeader& header, std::span<const unsigned char> stored) {
  constexpr std::size_t kPiece = std::size_t{1} << 20;
  const std::unique_ptr<ZSTD_DStream, decltype(&ZSTD_freeDStream)> stream(ZSTD_createDStream(),
                                                                          &ZSTD_freeDStream);
  if (!stream) throw std::bad_alloc();
  const std::uint64_t wanted = header.raw_bytes;
  FileBytes raw;
  ZSTD_inBuffer in{stored.data(), stored.size(), 0};
  std::size_t left = 1;
  while (left != 0) {
    const std::size_t begin = raw.size();
    // One byte more than is wanted shows that there is more.
    raw.resize(std::min<std::uint64_t>(begin + std::max(begin, kPiece), wanted + 1));
    ZSTD_outBuffer out{raw.data(), raw.size(), begin};
    left = ZSTD_decompressStream(stream.get(), &out, &in);
    raw.resize(out.pos);
    const bool stands_still = out.pos == begin && in.pos == in.size && left != 0;
    if (ZSTD_isError(left) || stands_still || raw.size() > wanted)
      throw DecodeError("the block does not decompress");
  }
  if (raw.size() != wanted || in.pos != in.size) throw DecodeError("the block does not decompress");
  return raw;
}

// Calls `decode` with what the block holds.
template <class Decode>
auto decode_payload(const BlockHeader& header, const FileBytes& stored, Decode decode) {
  if (stands_as_it_is(header)) return decode(stored.view());
  return decode(decompressed(header, stored.view()).view());
}

}  // namespace

// Which type block number `index` must have. The rest are mesh blocks, then steps, with blocks of
// trace and of bounds behind the first, then the last states and the end.
bool LogReader::type_fits(std::uint32_t index, BlockType type) const {
  switch (index) {
    case 0:
      return type == BlockType::kScenario;
    case 1:
      return type == BlockType::kOptions;
    case 2:
      return type == BlockType::kBodies;
    default:
      return type == BlockType::kStep || type == BlockType::kEnd ||
             (type == BlockType::kMesh && step_blocks_.empty()) ||
             ((type == BlockType::kTrace || type == BlockType::kBounds ||
               type == BlockType::kLast) &&
              !step_blocks_.empty());
  }
}

LogReader::LogReader(const std::string& file) : file_(file) {
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  if (!error && std::filesystem::exists(status) && !std::filesystem::is_regular_file(status))
    throw scenarios::FileError(file + ": cannot be read: is no regular file");
  file_bytes_ = std::filesystem::file_size(file, error);
  in_.rdbuf()->pubsetbuf(nullptr, 0);  // what is read is of the size that is needed
  if (!error) in_.open(file, std::ios::binary);
  if (error || !in_) {
    throw scenarios::FileError(
        file + ": cannot be read: " + (error ? error.message() : "cannot be opened"));
  }
  FileBytes header;
  try {
    read_bytes(in_, std::min<std::uint64_t>(file_bytes_, kFileHeaderBytes), header);
    decode_file_header(header.view());
  } catch (const DecodeError& fault) {
    throw scenarios::FileError(file + ": " + fault.what());
  }
  Block block;
  for (;;) {
    const std::streamoff offset = in_.tellg();
    if (next_block(block) == Next::kEnd || !keep(block, offset)) break;
  }
  if (step_blocks_.empty()) {
    throw scenarios::FileError(file + ": holds no whole step: " + (cut_.empty() ? damage_ : cut_));
  }
}

std::string LogReader::place(std::streamoff offset) const {
  std::string text = "block " + std::to_string(blocks_);
  if (blocks_ >= kBlocksBeforeMeshes + meshes_.size())
    text += " (step " + std::to_string(last_step() + 1) + ")";
  return text + " at byte " + std::to_string(offset);
}

std::string LogReader::place_of(std::int64_t step) const {
  const Place& at = block_of(step);
  return "block " + std::to_string(at.block) + " (step " + std::to_string(step) + ") at byte " +
         std::to_string(at.offset);
}

LogReader::Next LogReader::next_block(Block& block) {
  const std::streamoff offset = in_.tellg();
  const std::uint64_t left = file_bytes_ - static_cast<std::uint64_t>(offset);
  if (left == 0) {
    if (!complete_) cut_ = "cut off before " + place(offset);
    return Next::kEnd;
  }
  if (complete_) {
    damage_ = std::to_string(left) + " bytes follow the end block";
    return Next::kEnd;
  }
  FileBytes header;
  if (left < kBlockHeaderBytes || !read_bytes(in_, kBlockHeaderBytes, header)) {
    cut_ = "cut off inside the header of " + place(offset);
    return Next::kEnd;
  }
  try {
    block.header = decode_block_header(header.view());
  } catch (const DecodeError&) {
    damage_ = place(offset) + ": the block's header does not match its checksum";
    return Next::kEnd;
  }
  std::uint64_t most = max_raw_bytes(block.header.type, labels_.size());
  if (block.header.type == BlockType::kMesh) most = std::min(most, left_for_meshes_);
  if (block.header.raw_bytes > most || block.header.stored_bytes > ZSTD_compressBound(most)) {
    damage_ = place(offset) + ": says that it holds " + std::to_string(block.header.raw_bytes) +
              " bytes; allowed: at most " + std::to_string(most);
    return Next::kEnd;
  }
  if (block.header.stored_bytes > left - kBlockHeaderBytes ||
      !read_bytes(in_, block.header.stored_bytes, block.stored)) {
    cut_ = "cut off inside " + place(offset);
    return Next::kEnd;
  }
  return Next::kBlock;
}

// Whether the block is sound and the file goes on.
bool LogReader::keep(const Block& block, std::streamoff offset) {
  const BlockHeader& header = block.header;
  if (header.index != blocks_ || !type_fits(blocks_, header.type)) {
    damage_ = place(offset) + ": is not the block that belongs here";
    return false;
  }
  if (checksum(block.stored.view()) != header.stored_checksum) {
    damage_ = place(offset) + ": the block's content does not match its checksum";
    return false;
  }
  try {
    if (header.type == BlockType::kScenario)
      scenario_ = decode_payload(header, block.stored, decode_scenario);
    if (header.type == BlockType::kOptions)
      options_ = decode_payload(header, block.stored, decode_options);
    if (header.type == BlockType::kBodies)
      labels_ = decode_payload(header, block.stored, decode_labels);
    if (header.type == BlockType::kMesh) {
      meshes_.push_back(decode_payload(header, block.stored, decode_mesh));
      left_for_meshes_ -= header.raw_bytes;
    }
  } catch (const DecodeError& fault) {
    damage_ = place(offset) + ": " + fault.what();
    return false;
  }
  // Of what is compressed, no part can be read: it counts as empty.
  const Place at{blocks_, offset, stands_as_it_is(header) ? header.stored_bytes : 0};
  if (header.type == BlockType::kStep) step_blocks_.push_back(at);
  if (header.type == BlockType::kTrace) trace_blocks_.push_back(at);
  if (header.type == BlockType::kBounds) bounds_blocks_.push_back(at);
  if (header.type == BlockType::kLast) last_block_ = at;
  if (header.type == BlockType::kEnd) {
    complete_ = true;
    if (!step_blocks_.empty()) check_end(block, offset);
  }
  ++blocks_;
  return true;
}

// The whole file is read, so an end that is not that of its steps was not written by soda.
void LogReader::check_end(const Block& block, std::streamoff offset) {
  const std::streamoff next = in_.tellg();
  std::string wrong;
  try {
    const LoggedEnd end = decode_payload(block.header, block.stored, decode_end);
    const StepHead last = read_head(last_step());
    execution_digest_ = end.execution_digest;
    if (end.steps != last_step() || end.digest != last.digest)
      wrong = "tells of the end of step " + std::to_string(end.steps) + ", but the last one is " +
              std::to_string(last_step()) + ", or its digest another";
  } catch (const DecodeError& fault) {
    wrong = fault.what();
  }
  if (!wrong.empty())
    throw scenarios::FileError(file_ + ": block " + std::to_string(blocks_) + " (end) at byte " +
                               std::to_string(offset) + ": " + wrong);
  in_.clear();
  in_.seekg(next);
}

FileBytes LogReader::read_again(const Place& at) {
  in_.clear();
  in_.seekg(at.offset);
  Block block;
  FileBytes header;
  if (!read_bytes(in_, kBlockHeaderBytes, header)) throw DecodeError("cannot be read again");
  block.header = decode_block_header(header.view());
  if (block.header.stored_bytes > file_bytes_ ||
      !read_bytes(in_, block.header.stored_bytes, block.stored))
    throw DecodeError("cannot be read again");
  if (stands_as_it_is(block.header)) return std::move(block.stored);
  return decompressed(block.header, block.stored.view());
}

void LogReader::refuse(std::int64_t step, const std::string& why) const {
  throw scenarios::FileError(file_ + ": " + place_of(step) + ": " + why);
}

void LogReader::check_head(std::int64_t step, const StepHead& head) const {
  if (head.step != step) throw DecodeError("holds step " + std::to_string(head.step));
  if (head.has_states != has_states(options_, step))
    throw DecodeError("has states where the log has none, or none where it has");
  if (head.has_states && head.is_whole != is_whole(options_, step))
    throw DecodeError("has whole states where the log has a difference, or the other way round");
}

FileBytes LogReader::read_part(std::int64_t step, std::uint64_t begin, std::uint64_t count) {
  const Place& at = block_of(step);
  FileBytes bytes;
  if (at.bytes == 0) {
    FileBytes whole;
    try {
      whole = read_again(at);
    } catch (const DecodeError& fault) {
      refuse(step, fault.what());
    }
    if (begin > whole.size() || count > whole.size() - begin) refuse(step, "ends inside a field");
    bytes.resize(count);
    std::ranges::copy(whole.view().subspan(begin, count), bytes.data());
    return bytes;
  }
  in_.clear();
  in_.seekg(at.offset + static_cast<std::streamoff>(kBlockHeaderBytes + begin));
  if (begin > at.bytes || count > at.bytes - begin || !read_bytes(in_, count, bytes))
    refuse(step, "ends inside a field");
  return bytes;
}

StepParts LogReader::step_parts_of(std::int64_t step) {
  return step_parts(read_part(step, 0, kStepHeadBytes).view());
}

StepHead LogReader::read_head(std::int64_t step) {
  try {
    const FileBytes raw = read_part(step, 0, step_parts_of(step).head_bytes);
    ByteReader in(raw.view());
    StepHead head = decode_step_head(in, in_log(step));
    check_head(step, head);
    return head;
  } catch (const DecodeError& fault) {
    refuse(step, fault.what());
  }
}

LoggedStates LogReader::read_last_states() {
  if (!last_block_) {
    LoggedStep last = read_states(last_step());
    return {std::move(last.ids), std::move(last.states)};
  }
  try {
    return decode_last_states(read_again(*last_block_).view(), labels_.size());
  } catch (const DecodeError& fault) {
    throw scenarios::FileError(file_ + ": block " + std::to_string(last_block_->block) +
                               " (last states) at byte " + std::to_string(last_block_->offset) +
                               ": " + fault.what());
  }
}

std::optional<MotionBounds> LogReader::read_bounds(std::int64_t step) {
  const auto index = static_cast<std::size_t>((step - first_step()) / kBoundedSteps);
  // Where steps are compressed, all bodies are read as soon as one is.
  if (index >= bounds_blocks_.size() || block_of(step + 1).bytes == 0) return std::nullopt;
  const Place& at = bounds_blocks_[index];
  const std::int64_t first = first_step() + static_cast<std::int64_t>(index) * kBoundedSteps;
  try {
    MotionBounds bounds = decode_bounds(read_again(at).view(), labels_.size());
    if (bounds.first_step != first ||
        bounds.last_step != std::min(first + kBoundedSteps, last_step()))
      throw DecodeError("holds bounds of other steps");
    return bounds;
  } catch (const DecodeError& fault) {
    throw scenarios::FileError(file_ + ": block " + std::to_string(at.block) +
                               " (bounds) at byte " + std::to_string(at.offset) + ": " +
                               fault.what());
  }
}

// The states before, if it needs them, are last_.
LoggedStep LogReader::read_after_last(std::int64_t step) {
  try {
    const bool follows = last_read_ >= 0 && last_read_ == step - options_.every;
    LoggedStep logged = decode_step(read_again(block_of(step)).view(), in_log(step),
                                    follows ? &last_ : nullptr, between_s());
    if (logged.step != step) throw DecodeError("holds step " + std::to_string(logged.step));
    if (logged.has_states != has_states(options_, step))
      throw DecodeError("has states where the log has none, or none where it has");
    return logged;
  } catch (const DecodeError& fault) {
    refuse(step, fault.what());
  }
}

// Differences lead from the whole states before to the step.
LoggedStep LogReader::read_step(std::int64_t step) {
  if (!has_states(options_, step)) return read_after_last(step);
  const std::int64_t since = (step - first_step()) / options_.every % kStatesAWhole;
  const std::int64_t whole = step - since * options_.every;
  const bool is_on_the_way = last_read_ >= whole && last_read_ < step;
  std::int64_t next = is_on_the_way ? last_read_ + options_.every : whole;
  for (; next < step; next += options_.every) {
    LoggedStep before = read_after_last(next);
    last_ = {std::move(before.ids), std::move(before.states)};
    last_read_ = next;
  }
  LoggedStep logged = read_after_last(step);
  last_ = {logged.ids, logged.states};
  last_read_ = step;
  return logged;
}

std::int64_t LogReader::last_states() const {
  std::int64_t step = last_step();
  while (step > first_step() && !has_states(options_, step)) --step;
  if (!has_states(options_, step))
    throw UsageError(file_ + ": has no states; soda run --log-level commits writes them");
  return step;
}

LoggedStep LogReader::read_states(std::int64_t step) {
  LoggedStep logged = read_step(step);
  if (logged.has_states) return logged;
  throw UsageError(file_ + ": has no states of step " + std::to_string(step) +
                   "; the last are of step " + std::to_string(last_states()) +
                   ", and it has those of every " + std::to_string(options_.every) + "th step");
}

kernel::Bytes LogReader::read_trace(std::size_t index) {
  const Place& at = trace_blocks_[index];
  try {
    const FileBytes raw = read_again(at);
    const auto bytes = std::as_bytes(raw.view());
    return {bytes.begin(), bytes.end()};
  } catch (const DecodeError& fault) {
    throw scenarios::FileError(file_ + ": block " + std::to_string(at.block) + " (trace) at byte " +
                               std::to_string(at.offset) + ": " + fault.what());
  }
}

}  // namespace soda::analysis
