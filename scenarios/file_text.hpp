// Whole files into memory.
#pragma once

#include <cstddef>
#include <string>

namespace soda::scenarios {

// The bytes of a regular file, or why they cannot be had: a FIFO or a device would block, or never
// end. Reads at most max_bytes + 1 bytes, so that a
// caller sees by the size that there are more.
struct FileText {
  std::string bytes;
  std::string failure;  // empty if read
};
FileText read_file_text(const std::string& path, std::size_t max_bytes);

}  // namespace soda::scenarios
