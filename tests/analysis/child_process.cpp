#include "analysis/child_process.hpp"

#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace soda::analysis_test {
namespace {

[[noreturn]] void become(const std::vector<std::string>& argv, int out, int err,
                         const Meanwhile& meanwhile) {
  std::vector<char*> arguments;
  for (const std::string& argument : argv) {
    arguments.push_back(const_cast<char*>(argument.c_str()));
  }
  arguments.push_back(nullptr);
  dup2(out, STDOUT_FILENO);
  dup2(err, STDERR_FILENO);
  for (const int number : {SIGINT, SIGTERM}) std::signal(number, SIG_DFL);
  meanwhile.in_child();
  execv(arguments[0], arguments.data());
  _exit(127);
}

// Both pipes are read as they fill, so that a child that writes much to one never blocks.
void drain(std::array<int, 2> pipes, std::array<std::string*, 2> texts) {
  std::array<bool, 2> open{true, true};
  std::array<char, 65536> buffer{};
  while (open[0] || open[1]) {
    std::array<pollfd, 2> polled{};
    for (std::size_t i = 0; i < 2; ++i) {
      polled[i] = {open[i] ? pipes[i] : -1, POLLIN, 0};
    }
    if (poll(polled.data(), polled.size(), -1) < 0) throw std::runtime_error("poll failed");
    for (std::size_t i = 0; i < 2; ++i) {
      if (polled[i].revents == 0) continue;
      const ssize_t count = read(pipes[i], buffer.data(), buffer.size());
      if (count > 0) texts[i]->append(buffer.data(), static_cast<std::size_t>(count));
      open[i] = count > 0;
    }
  }
}

}  // namespace

ChildResult run_child(const std::vector<std::string>& argv) { return run_child(argv, {}); }

ChildResult run_child(const std::vector<std::string>& argv, const Meanwhile& meanwhile) {
  std::array<int, 2> out{}, err{};
  if (pipe(out.data()) != 0 || pipe(err.data()) != 0) throw std::runtime_error("pipe failed");
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("fork failed");
  if (child == 0) become(argv, out[1], err[1], meanwhile);
  close(out[1]);
  close(err[1]);
  meanwhile.here(child);
  ChildResult result;
  drain({out[0], err[0]}, {&result.out, &result.err});
  close(out[0]);
  close(err[0]);
  int status = 0;
  rusage usage{};
  if (wait4(child, &status, 0, &usage) != child) throw std::runtime_error("wait4 failed");
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  result.signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  result.cpu_s = seconds(usage.ru_utime) + seconds(usage.ru_stime);
  result.peak_rss_kib = usage.ru_maxrss;
  return result;
}

ChildResult run_soda(const std::vector<std::string>& arguments) { return run_soda(arguments, {}); }

ChildResult run_soda(const std::vector<std::string>& arguments, const Meanwhile& meanwhile) {
  std::vector<std::string> argv = {SODA_BINARY_DIR "/soda"};
  argv.insert(argv.end(), arguments.begin(), arguments.end());
  return run_child(argv, meanwhile);
}

std::string library_file(const std::string& name) {
  return SODA_SOURCE_DIR "/scenarios/library/" + name + ".json";
}

TemporaryFolder::TemporaryFolder() {
  std::string pattern = (std::filesystem::temp_directory_path() / "soda-test-XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("mkdtemp failed");
  path_ = pattern;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

std::string TemporaryFolder::file(const std::string& name) const { return path_ + "/" + name; }

std::vector<std::string> TemporaryFolder::files() const {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(path_))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

std::string read_file(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

void write_file(const std::string& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

}  // namespace soda::analysis_test
