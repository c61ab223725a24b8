#include "scenarios/file_text.hpp"

#include <sys/stat.h>

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
  errno = 0;
  const std::unique_ptr<std::FILE, CloseFile> file(std::fopen(path.c_str(), "rb"));
  if (!file) return {"", std::strerror(errno)};
  struct stat status {};
  if (fstat(fileno(file.get()), &status) == 0 && S_ISDIR(status.st_mode)) {
    return {"", "is a directory"};
  }
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
