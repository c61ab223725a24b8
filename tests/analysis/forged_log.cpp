#include "analysis/forged_log.hpp"

#include <zstd.h>

#include <stdexcept>

#include "analysis/child_process.hpp"
#include "analysis/event_log/log_reader.hpp"
#include "analysis/event_log/log_writer.hpp"

namespace soda::analysis_test {

using namespace analysis;

void forge_log(const std::string& from, const std::string& to,
               const std::function<void(ForgedBlock&)>& change) {
  const std::string text = read_file(from);
  const auto* data = reinterpret_cast<const unsigned char*>(text.data());
  ByteBuffer out(data, data + kFileHeaderBytes);
  for (std::size_t at = kFileHeaderBytes; at < text.size();) {
    const BlockHeader header = decode_block_header({data + at, kBlockHeaderBytes});
    at += kBlockHeaderBytes;
    ForgedBlock block{header.type, -1, ByteBuffer(header.raw_bytes), 0};
    if (is_compressed(block.type) || header.stored_bytes < header.raw_bytes) {
      const std::size_t size = ZSTD_decompress(block.payload.data(), block.payload.size(),
                                               data + at, header.stored_bytes);
      if (size != header.raw_bytes) throw std::runtime_error("not a sound log");
    } else {
      block.payload.assign(data + at, data + at + header.stored_bytes);
    }
    at += header.stored_bytes;
    if (block.type == BlockType::kStep) block.step = ByteReader(block.payload).take<std::int64_t>();
    change(block);
    ByteBuffer stored = block.payload;
    if (is_compressed(block.type)) {
      stored.resize(ZSTD_compressBound(block.payload.size()));
      stored.resize(ZSTD_compress(stored.data(), stored.size(), block.payload.data(),
                                  block.payload.size(), 1));
    }
    const std::uint64_t claimed = block.claimed > 0 ? block.claimed : block.payload.size();
    const ByteBuffer forged =
        encode(BlockHeader{block.type, header.index, claimed, stored.size(), checksum(stored)});
    out.insert(out.end(), forged.begin(), forged.end());
    out.insert(out.end(), stored.begin(), stored.end());
  }
  write_file(to, std::string(out.begin(), out.end()));
}

void rewrite_log(const std::string& from, const std::string& to,
                 const std::function<void(LoggedStep&)>& change) {
  LogReader log(from);
  LogWriter altered(to, true);
  altered.begin(log.scenario(), log.options(), log.labels(), log.meshes());
  for (std::int64_t step = 0; step <= log.last_step(); ++step) {
    LoggedStep logged = log.read_step(step);
    change(logged);
    altered.add_step(std::move(logged));
  }
  altered.finish();
}

}  // namespace soda::analysis_test
