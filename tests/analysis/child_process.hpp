// Running a program as a user does.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace soda::analysis_test {

struct ChildResult {
  int exit_code = -1;  // -1: ended by a signal
  int signal = 0;      // which one
  std::string out, err;
  long peak_rss_kib = 0;
  double cpu_s = 0.0;
};

// Runs argv[0] (a path) and waits for it. `out` and `err` are pipes, no terminals.
ChildResult run_child(const std::vector<std::string>& argv);

// What else happens: in the child before it becomes the program, and here while it runs.
struct Meanwhile {
  std::function<void()> in_child = [] {};
  std::function<void(int child)> here = [](int) {};
};
ChildResult run_child(const std::vector<std::string>& argv, const Meanwhile& meanwhile);
ChildResult run_soda(const std::vector<std::string>& arguments, const Meanwhile& meanwhile);

// build/.../soda with these arguments.
ChildResult run_soda(const std::vector<std::string>& arguments);

std::string library_file(const std::string& name);  // "pyramid" -> path

// A new empty directory, removed at the end.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  std::string file(const std::string& name) const;
  std::vector<std::string> files() const;  // names of all there are

 private:
  std::string path_;
};

bool contains(const std::string& text, const std::string& part);

std::string read_file(const std::string& file);
void write_file(const std::string& file, const std::string& bytes);

}  // namespace soda::analysis_test
