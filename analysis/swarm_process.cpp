#include "analysis/swarm_process.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "analysis/exit_codes.hpp"

namespace soda::analysis {
namespace {

constexpr unsigned kMostSeconds = 60;
constexpr int kViolated = 1;

// Both ends of a pipe, closed when it goes.
class Pipe {
 public:
  Pipe() {
    if (pipe(ends_.data()) != 0)
      throw CheckFailed(std::string("swarm: no pipe: ") + std::strerror(errno));
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

template <class T>
void write_object(int file, const T& object) {
  const char* bytes = reinterpret_cast<const char*>(&object);
  for (std::size_t done = 0; done < sizeof object;) {
    const ssize_t count = write(file, bytes + done, sizeof object - done);
    if (count < 0 && errno != EINTR) _exit(2);
    if (count > 0) done += static_cast<std::size_t>(count);
  }
}

// Decisions, then the sums; what is wrong goes to standard error.
[[noreturn]] void run_child(const SwarmSubject& subject, const Trial& trial, bool record,
                            int results, int errors) {
  dup2(errors, STDERR_FILENO);
  alarm(kMostSeconds);
  const auto tell = [&](const kernel::Decision& decision) { write_object(results, decision); };
  try {
    const TrialSums sums = run_trial(
        subject, trial, record ? std::function<void(const kernel::Decision&)>(tell) : nullptr);
    if (!record) write_object(results, sums);
    _exit(0);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    std::fflush(stderr);
    _exit(kViolated);
  }
}

std::string trimmed(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text;
}

}  // namespace

TrialOutcome run_isolated(const SwarmSubject& subject, const Trial& trial, bool record) {
  Pipe results, errors;
  std::fflush(nullptr);
  const pid_t child = fork();
  if (child < 0) throw CheckFailed(std::string("swarm: no process: ") + std::strerror(errno));
  if (child == 0) run_child(subject, trial, record, results.write_end(), errors.write_end());
  results.close_write_end();
  errors.close_write_end();
  const std::string result = results.read_all();
  TrialOutcome outcome;
  outcome.what = trimmed(errors.read_all());
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
  outcome.failed = !(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  if (WIFSIGNALED(status))
    outcome.what += (outcome.what.empty() ? "" : "\n") + std::string("ended by signal ") +
                    std::to_string(WTERMSIG(status)) + " (" + strsignal(WTERMSIG(status)) + ")";
  if (record) {
    outcome.decisions.resize(result.size() / sizeof(kernel::Decision));
    std::memcpy(outcome.decisions.data(), result.data(),
                outcome.decisions.size() * sizeof(kernel::Decision));
  } else if (!outcome.failed && result.size() == sizeof outcome.sums) {
    std::memcpy(&outcome.sums, result.data(), sizeof outcome.sums);
  }
  return outcome;
}

}  // namespace soda::analysis
