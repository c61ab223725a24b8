#include "analysis/log_writer.hpp"

#include <zstd.h>

#include <cerrno>
#include <cstring>

#include "scenarios/read_scenario.hpp"

namespace soda::analysis {
namespace {

// The lowest level: random low bits of doubles hardly compress further at higher ones.
constexpr int kCompressionLevel = 1;

ByteBuffer compress(std::span<const unsigned char> raw) {
  ByteBuffer stored(ZSTD_compressBound(raw.size()));
  const std::size_t size =
      ZSTD_compress(stored.data(), stored.size(), raw.data(), raw.size(), kCompressionLevel);
  stored.resize(ZSTD_isError(size) ? 0 : size);
  return stored;
}

void write(std::ofstream& out, const ByteBuffer& bytes) {
  out.write(reinterpret_cast<const char*>(bytes.data()),
            static_cast<std::streamsize>(bytes.size()));
}

}  // namespace

LogWriter::LogWriter(const std::string& file)
    : file_(file), out_(file, std::ios::binary | std::ios::trunc) {
  if (!out_) {
    throw scenarios::FileError(file + ": cannot be written: " + std::strerror(errno));
  }
  write(out_, encode_file_header());
}

void LogWriter::begin(const LoggedScenario& scenario, const Overrides& overrides,
                      std::span<const std::uint32_t> labels) {
  write_block(BlockType::kScenario, encode(scenario));
  write_block(BlockType::kOverrides, encode(overrides));
  write_block(BlockType::kBodies, encode_labels(labels));
  check();
}

void LogWriter::add_step(const LoggedStep& step) {
  write_block(BlockType::kStep, encode_step(step));
}

void LogWriter::finish(std::int64_t steps, std::uint64_t digest) {
  write_block(BlockType::kEnd, encode_end(steps, digest));
  out_.close();
  check();
}

void LogWriter::write_block(BlockType type, std::span<const unsigned char> payload) {
  const ByteBuffer stored = compress(payload);
  if (stored.empty()) out_.setstate(std::ios::failbit);
  if (!out_) return;
  write(out_,
        encode(BlockHeader{type, next_index_++, payload.size(), stored.size(), checksum(stored)}));
  write(out_, stored);
  out_.flush();
}

void LogWriter::check() const {
  if (!out_) throw scenarios::FileError(file_ + ": writing the log failed");
}

}  // namespace soda::analysis
