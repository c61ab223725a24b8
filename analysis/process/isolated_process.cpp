#include "analysis/process/isolated_process.hpp"

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "analysis/text/exit_codes.hpp"

namespace soda::analysis {
namespace {

constexpr int kThrew = 1;

// Both ends of a pipe, closed when it goes.
class Pipe {
 public:
  Pipe() {
    if (pipe(ends_.data()) != 0) throw CheckFailed(std::string("no pipe: ") + std::strerror(errno));
  }
  ~Pipe() {
    close_end(0);
    close_end(1);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;

  int write_end() const { return ends_[1]; }
  void close_write_end() { close_end(1); }

  std::string read_all() {
    std::string text;
    std::array<char, 4096> chunk;
    while (true) {
      const ssize_t count = read(ends_[0], chunk.data(), chunk.size());
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) return text;
      text.append(chunk.data(), static_cast<std::size_t>(count));
    }
  }

 private:
  void close_end(std::size_t end) {
    if (ends_[end] >= 0) close(ends_[end]);
    ends_[end] = -1;
  }

  std::array<int, 2> ends_{-1, -1};
};

// Of this process. The signals end it: SIGXCPU and SIGALRM.
void set_limits(const ChildLimits& limits) {
  rlimit cpu{};
  getrlimit(RLIMIT_CPU, &cpu);
  cpu.rlim_cur = std::min<rlim_t>(limits.cpu_s, cpu.rlim_max);
  setrlimit(RLIMIT_CPU, &cpu);
  alarm(limits.wall_s);
}

[[noreturn]] void run_and_exit(const std::function<void(ChildResults&)>& work,
                               const ChildLimits& limits, int results, int errors) {
  dup2(errors, STDERR_FILENO);
  set_limits(limits);
  try {
    ChildResults to_parent(results);
    work(to_parent);
    _exit(0);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    std::fflush(stderr);
    _exit(kThrew);
  }
}

std::string trimmed(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text;
}

}  // namespace

void ChildResults::write_bytes(const char* bytes, std::size_t size) {
  for (std::size_t done = 0; done < size;) {
    const ssize_t count = ::write(file_, bytes + done, size - done);
    if (count < 0 && errno != EINTR) _exit(2);
    if (count > 0) done += static_cast<std::size_t>(count);
  }
}

ChildOutcome run_in_child(const std::function<void(ChildResults&)>& work,
                          const ChildLimits& limits) {
  Pipe results, errors;
  std::fflush(nullptr);
  const pid_t child = fork();
  if (child < 0) throw CheckFailed(std::string("no process: ") + std::strerror(errno));
  if (child == 0) run_and_exit(work, limits, results.write_end(), errors.write_end());
  results.close_write_end();
  errors.close_write_end();
  ChildOutcome outcome;
  outcome.bytes = results.read_all();
  outcome.what = trimmed(errors.read_all());
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
  outcome.failed = !(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  if (WIFSIGNALED(status))
    outcome.what += (outcome.what.empty() ? "" : "\n") + std::string("ended by signal ") +
                    std::to_string(WTERMSIG(status)) + " (" + strsignal(WTERMSIG(status)) + ")";
  return outcome;
}

}  // namespace soda::analysis
