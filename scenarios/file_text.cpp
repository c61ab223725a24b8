#include "scenarios/file_text.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

namespace soda::scenarios {
namespace {

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

}  // namespace

FileText read_file_text(const std::string& path, std::size_t max_bytes) {
  if (path.find('\0') != std::string::npos) return {"", "a file name with a zero byte"};
  // Without O_NONBLOCK, opening a FIFO waits for somebody who writes to it.
  const int descriptor = open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
  if (descriptor < 0) return {"", std::strerror(errno)};
  const std::unique_ptr<std::FILE, CloseFile> file(fdopen(descriptor, "rb"));
  if (!file) {
    close(descriptor);
    return {"", std::strerror(errno)};
  }
  struct stat status {};
  if (fstat(descriptor, &status) != 0) return {"", std::strerror(errno)};
  if (S_ISDIR(status.st_mode)) return {"", "is a directory"};
  if (!S_ISREG(status.st_mode)) return {"", "is no regular file"};
  FileText text;
  char buffer[65536];
  while (text.bytes.size() <= max_bytes) {
    const std::size_t wanted = std::min(sizeof buffer, max_bytes + 1 - text.bytes.size());
    const std::size_t got = std::fread(buffer, 1, wanted, file.get());
    text.bytes.append(buffer, got);
    if (got < wanted) break;
  }
  if (std::ferror(file.get())) return {"", std::strerror(errno)};
  return text;
}

}  // namespace soda::scenarios
