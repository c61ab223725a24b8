#include "analysis/log_reader.hpp"

#include <zstd.h>

#include <filesystem>

#include "analysis/exit_codes.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::analysis {
namespace {

constexpr std::uint32_t kBlocksBeforeSteps = 3;

bool read(std::ifstream& in, std::size_t count, ByteBuffer& bytes) {
  bytes.resize(count);
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(count));
  return static_cast<std::size_t>(in.gcount()) == count;
}

// Which type block number `index` must have; step and end blocks share the rest.
bool type_fits(std::uint32_t index, BlockType type) {
  switch (index) {
    case 0:
      return type == BlockType::kScenario;
    case 1:
      return type == BlockType::kOverrides;
    case 2:
      return type == BlockType::kBodies;
    default:
      return type == BlockType::kStep || type == BlockType::kEnd;
  }
}

}  // namespace

LogReader::LogReader(const std::string& file) : file_(file), in_(file, std::ios::binary) {
  std::error_code error;
  file_bytes_ = std::filesystem::file_size(file, error);
  if (!in_ || error) {
    throw scenarios::FileError(
        file + ": cannot be read: " + (error ? error.message() : "cannot be opened"));
  }
  ByteBuffer header;
  try {
    read(in_, std::min<std::uint64_t>(file_bytes_, kFileHeaderBytes), header);
    decode_file_header(header);
  } catch (const DecodeError& fault) {
    throw scenarios::FileError(file + ": " + fault.what());
  }
  Block block;
  for (;;) {
    const std::streamoff offset = in_.tellg();
    if (next_block(block) == Next::kEnd || !keep(block, offset)) break;
  }
  if (step_offsets_.empty()) {
    throw scenarios::FileError(file + ": holds no whole step: " + (cut_.empty() ? damage_ : cut_));
  }
}

std::string LogReader::place(std::streamoff offset) const {
  std::string text = "block " + std::to_string(blocks_);
  if (blocks_ >= kBlocksBeforeSteps) text += " (step " + std::to_string(last_step() + 1) + ")";
  return text + " at byte " + std::to_string(offset);
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
  ByteBuffer header;
  if (left < kBlockHeaderBytes || !read(in_, kBlockHeaderBytes, header)) {
    cut_ = "cut off inside the header of " + place(offset);
    return Next::kEnd;
  }
  try {
    block.header = decode_block_header(header);
  } catch (const DecodeError&) {
    damage_ = place(offset) + ": the block's header does not match its checksum";
    return Next::kEnd;
  }
  if (block.header.stored_bytes > left - kBlockHeaderBytes ||
      !read(in_, block.header.stored_bytes, block.stored)) {
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
  if (checksum(block.stored) != header.stored_checksum) {
    damage_ = place(offset) + ": the block's content does not match its checksum";
    return false;
  }
  try {
    if (header.type == BlockType::kScenario) scenario_ = decode_scenario(raw_payload(block));
    if (header.type == BlockType::kOverrides) overrides_ = decode_overrides(raw_payload(block));
    if (header.type == BlockType::kBodies) labels_ = decode_labels(raw_payload(block));
  } catch (const DecodeError& fault) {
    damage_ = place(offset) + ": " + fault.what();
    return false;
  }
  if (header.type == BlockType::kStep) step_offsets_.push_back(offset);
  if (header.type == BlockType::kEnd) complete_ = true;
  ++blocks_;
  return true;
}

ByteBuffer LogReader::raw_payload(const Block& block) const {
  if (block.header.raw_bytes > kMaxRawBytes) throw DecodeError("the block is too large");
  ByteBuffer raw(block.header.raw_bytes);
  const std::size_t size =
      ZSTD_decompress(raw.data(), raw.size(), block.stored.data(), block.stored.size());
  if (ZSTD_isError(size) || size != raw.size()) throw DecodeError("the block does not decompress");
  return raw;
}

LoggedStep LogReader::read_step(std::int64_t step) {
  in_.clear();
  in_.seekg(step_offsets_[static_cast<std::size_t>(step)]);
  const std::string where = file_ + ": block of step " + std::to_string(step) + ": ";
  Block block;
  ByteBuffer header;
  try {
    if (!read(in_, kBlockHeaderBytes, header)) throw DecodeError("cannot be read again");
    block.header = decode_block_header(header);
    if (!read(in_, block.header.stored_bytes, block.stored)) {
      throw DecodeError("cannot be read again");
    }
    LoggedStep logged = decode_step(raw_payload(block));
    const bool known = logged.ids.empty() || physics::index_of(logged.ids.back()) < labels_.size();
    if (logged.step != step || !known) {
      throw DecodeError("holds step " + std::to_string(logged.step) + " with " +
                        std::to_string(logged.states.size()) + " bodies");
    }
    return logged;
  } catch (const DecodeError& fault) {
    throw CheckFailed(where + fault.what());
  }
}

}  // namespace soda::analysis
