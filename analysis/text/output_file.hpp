// Files that the program writes for its user: whole or not at all, and never over another unasked.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace soda::analysis {

// What is written goes to a new file beside the target, TARGET.PROCESS-NUMBER.partial, which takes
// the target's name when it is complete. So two runs that write one file do not mix, and what a
// killed run leaves has another name.
class OutputFile {
 public:
  // Throws FileError if the target exists and `replaces` is not set, is no regular file (a link
  // is judged by what it leads to, and is replaced itself), or cannot be made.
  OutputFile(std::string file, bool replaces);
  // Removes what is not complete, unless it was to be kept.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  // Straight to the operating system. Throws FileError at once if not all of it can be written.
  void write(std::span<const unsigned char> bytes);
  void write(std::string_view text);

  // An incomplete file stays from now on: it is of use.
  void keep() { is_kept_ = true; }

  // Waits until the disk has what was written. Throws FileError.
  void put_on_disk();

  // Closes, and gives the file its name. Throws FileError if that fails, or if the target has come
  // to be meanwhile and `replaces` is not set.
  void complete();

  const std::string& file() const { return file_; }
  const std::string& partial_file() const { return partial_file_; }

 private:
  const std::string file_;
  const bool replaces_;
  std::string partial_file_;
  int descriptor_ = -1;
  bool is_kept_ = false;
  bool is_complete_ = false;
};

// A folder of such files, whole or not at all. It is filled as FOLDER.PROCESS-NUMBER.partial, which
// takes FOLDER's name when it is complete.
class OutputFolder {
 public:
  // Throws FileError if the folder exists and `replaces` is not set, if it is none, or holds
  // anything but files that end in one of `endings`, or if it cannot be made.
  OutputFolder(std::string folder, bool replaces, std::vector<std::string> endings);
  // Removes what is not complete.
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  // A new file in it. Throws FileError if not all of it can be written.
  void write(const std::string& name, std::string_view text);
  // Gives the folder its name. Throws FileError if that fails, or if there has come to be one that
  // it must not replace.
  void complete();

  const std::string& folder() const { return folder_; }

 private:
  const std::string folder_;
  const bool replaces_;
  const std::vector<std::string> endings_;
  std::string partial_folder_;
  bool is_complete_ = false;
};

// Throws UsageError, naming the option, if both lead to the same file: not even --force makes a
// command write over what it reads.
void refuse_own_input(const std::string& output, const std::string& input, const char* option);

}  // namespace soda::analysis
