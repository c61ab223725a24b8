#include "analysis/text/output_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <utility>

#include "analysis/text/exit_codes.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::analysis {
namespace {

using scenarios::FileError;

[[noreturn]] void refuse(const std::string& file, const std::string& why) {
  throw FileError(file + ": cannot be written: " + why);
}

constexpr const char* kExists = "it exists; --force replaces it";

void check_target(const std::string& file, bool replaces) {
  if (file.find('\0') != std::string::npos) refuse(file, "a file name with a zero byte");
  struct stat status {};
  if (lstat(file.c_str(), &status) != 0) {
    if (errno == ENOENT) return;
    refuse(file, std::strerror(errno));
  }
  // What a link leads to; a link to nothing may be replaced.
  if (stat(file.c_str(), &status) == 0 && !S_ISREG(status.st_mode))
    refuse(file, S_ISDIR(status.st_mode) ? "is a directory" : "is no regular file");
  if (!replaces) refuse(file, kExists);
}

// False if there is such a file.
bool rename_without_replacing(const std::string& from, const std::string& to) {
  if (renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return true;
  if (errno == EEXIST) return false;
  if (errno != EINVAL && errno != ENOSYS) refuse(to, std::strerror(errno));
  // A file system that cannot do it in one: a second name is not given over another either.
  if (link(from.c_str(), to.c_str()) == 0) {
    unlink(from.c_str());
    return true;
  }
  if (errno == EEXIST) return false;
  refuse(to, std::strerror(errno));
}

// What a folder to be replaced holds must be what is written again: nobody loses anything else.
void check_folder(const std::string& folder, bool replaces,
                  const std::vector<std::string>& endings) {
  struct stat status {};
  if (lstat(folder.c_str(), &status) != 0) {
    if (errno == ENOENT) return;
    refuse(folder, std::strerror(errno));
  }
  if (!S_ISDIR(status.st_mode)) refuse(folder, "is no folder");
  if (!replaces) refuse(folder, kExists);
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    const bool is_ours =
        entry.symlink_status().type() == std::filesystem::file_type::regular &&
        std::ranges::any_of(endings, [&name](const auto& end) { return name.ends_with(end); });
    if (!is_ours)
      refuse(folder, "it holds " + name + ", which --force does not replace; choose another name");
  }
  if (error) refuse(folder, error.message());
}

bool changes_places(const std::string& one, const std::string& other) {
  return renameat2(AT_FDCWD, one.c_str(), AT_FDCWD, other.c_str(), RENAME_EXCHANGE) == 0;
}

// "out/" is "out".
std::string without_slashes(std::string folder) {
  while (folder.size() > 1 && folder.back() == '/') folder.pop_back();
  return folder;
}

}  // namespace

OutputFile::OutputFile(std::string file, bool replaces)
    : file_(std::move(file)), replaces_(replaces) {
  check_target(file_, replaces_);
  for (int number = 0; descriptor_ < 0; ++number) {
    partial_file_ =
        file_ + "." + std::to_string(getpid()) + "-" + std::to_string(number) + ".partial";
    descriptor_ =
        open(partial_file_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
    if (descriptor_ < 0 && errno != EEXIST) refuse(file_, std::strerror(errno));
  }
}

OutputFile::~OutputFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (!is_complete_ && !is_kept_) unlink(partial_file_.c_str());
}

void OutputFile::write(std::span<const unsigned char> bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(descriptor_, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) refuse(file_, std::strerror(count < 0 ? errno : ENOSPC));
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
}

void OutputFile::write(std::string_view text) {
  write(std::span(reinterpret_cast<const unsigned char*>(text.data()), text.size()));
}

void OutputFile::put_on_disk() {
  if (fsync(descriptor_) != 0) refuse(file_, std::strerror(errno));
}

void OutputFile::complete() {
  const int descriptor = std::exchange(descriptor_, -1);
  if (::close(descriptor) != 0) refuse(file_, std::strerror(errno));
  if (replaces_) {
    check_target(file_, true);
    if (std::rename(partial_file_.c_str(), file_.c_str()) != 0) refuse(file_, std::strerror(errno));
  } else if (!rename_without_replacing(partial_file_, file_)) {
    refuse(file_, "it has come to exist during the run" +
                      (is_kept_ ? "; " + partial_file_ + " has what was written" : std::string()));
  }
  is_complete_ = true;
}

OutputFolder::OutputFolder(std::string folder, bool replaces, std::vector<std::string> endings)
    : folder_(without_slashes(std::move(folder))),
      replaces_(replaces),
      endings_(std::move(endings)) {
  check_folder(folder_, replaces_, endings_);
  for (int number = 0;; ++number) {
    partial_folder_ =
        folder_ + "." + std::to_string(getpid()) + "-" + std::to_string(number) + ".partial";
    if (mkdir(partial_folder_.c_str(), 0777) == 0) return;
    if (errno != EEXIST) refuse(folder_, std::strerror(errno));
  }
}

OutputFolder::~OutputFolder() {
  std::error_code none;
  if (!is_complete_) std::filesystem::remove_all(partial_folder_, none);
}

void OutputFolder::write(const std::string& name, std::string_view text) {
  OutputFile file(partial_folder_ + "/" + name, false);
  file.write(text);
  file.complete();
}

void OutputFolder::complete() {
  check_folder(folder_, replaces_, endings_);
  std::error_code error;
  if (replaces_ && changes_places(partial_folder_, folder_)) {
    std::filesystem::remove_all(partial_folder_, error);  // what was there before
  } else {
    if (replaces_) std::filesystem::remove_all(folder_, error);
    if (std::rename(partial_folder_.c_str(), folder_.c_str()) != 0)
      refuse(folder_, std::strerror(errno));
  }
  is_complete_ = true;
}

void refuse_own_input(const std::string& output, const std::string& input, const char* option) {
  std::error_code none;
  if (std::filesystem::equivalent(output, input, none))
    throw UsageError(std::string(option) + ": " + output + " is the file that is read, " + input);
}

}  // namespace soda::analysis
