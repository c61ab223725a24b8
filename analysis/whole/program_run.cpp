#include "analysis/whole/program_run.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "analysis/text/exit_codes.hpp"

namespace soda::analysis {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

[[noreturn]] void become(const std::vector<std::string>& argv, const ProgramLimits& limits,
                         const std::array<int, 2>& outputs) {
  setpgid(0, 0);
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  signal(SIGPIPE, SIG_DFL);
  dup2(open("/dev/null", O_RDONLY), STDIN_FILENO);
  dup2(outputs[0], STDOUT_FILENO);
  dup2(outputs[1], STDERR_FILENO);
  if (limits.address_bytes > 0) {
    const rlimit limit{limits.address_bytes, limits.address_bytes};
    setrlimit(RLIMIT_AS, &limit);
  }
  const auto cpu_s = static_cast<rlim_t>(limits.cpu_s) + 1;
  const rlimit cpu{cpu_s, cpu_s + 5};
  setrlimit(RLIMIT_CPU, &cpu);
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  if (geteuid() == 0) {  // Open MPI refuses root unless told twice
    setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 1);
    setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 1);
  }
  std::vector<char*> arguments;
  arguments.reserve(argv.size() + 1);
  for (const std::string& argument : argv) arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);
  execvp(arguments[0], arguments.data());
  _exit(127);
}

// Children of this process, those that were orphaned to it among them.
std::vector<pid_t> children() {
  std::vector<pid_t> found;
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    const std::string name = entry.path().filename().string();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    std::ifstream file(entry.path() / "stat");
    std::string stat;
    std::getline(file, stat);
    const std::size_t after = stat.rfind(')');  // of the command, which may hold anything
    if (after == std::string::npos || stat.size() < after + 5) continue;
    if (std::atoi(stat.c_str() + after + 4) == getpid()) found.push_back(std::atoi(name.c_str()));
  }
  return found;
}

// The program gets a moment to end what it started; then its group ends, and then what is left.
void end_all(pid_t program) {
  kill(program, SIGTERM);
  for (int i = 0; i < 20; ++i) {
    siginfo_t info{};
    waitid(P_PID, static_cast<id_t>(program), &info, WEXITED | WNOHANG | WNOWAIT);
    if (info.si_pid == program) break;
    usleep(50'000);
  }
  kill(-program, SIGKILL);
}

void end_orphans() {
  for (int round = 0; round < 100; ++round) {
    const std::vector<pid_t> left = children();
    if (left.empty()) return;
    for (const pid_t child : left) {
      kill(child, SIGKILL);
      waitpid(child, nullptr, 0);
    }
  }
}

// Reads until both pipes are closed or the time is over. False: it is over.
bool drain(const std::array<int, 2>& pipes, const std::array<std::string*, 2>& texts,
           Clock::time_point start, double limit_s) {
  constexpr std::size_t kMostText = std::size_t{64} << 20;
  std::array<bool, 2> open{true, true};
  std::array<char, 65536> buffer;
  while (open[0] || open[1]) {
    const double left_s = limit_s - seconds_since(start);
    if (left_s <= 0.0) return false;
    std::array<pollfd, 2> polled{};
    for (std::size_t i = 0; i < 2; ++i) polled[i] = {open[i] ? pipes[i] : -1, POLLIN, 0};
    if (poll(polled.data(), polled.size(), static_cast<int>(1000.0 * left_s) + 1) < 0) continue;
    for (std::size_t i = 0; i < 2; ++i) {
      if (polled[i].revents == 0) continue;
      const ssize_t count = read(pipes[i], buffer.data(), buffer.size());
      if (count > 0 && texts[i]->size() < kMostText)
        texts[i]->append(buffer.data(), static_cast<std::size_t>(count));
      open[i] = count > 0 || (count < 0 && errno == EINTR);
    }
  }
  return true;
}

// False: the time is over.
bool wait_for(pid_t program, Clock::time_point start, double limit_s, int& status) {
  for (useconds_t pause_us = 50;; pause_us = pause_us < 20'000 ? pause_us * 2 : pause_us) {
    if (waitpid(program, &status, WNOHANG) == program) return true;
    if (seconds_since(start) > limit_s) return false;
    usleep(pause_us);
  }
}

}  // namespace

ProgramOutcome run_program(const std::vector<std::string>& argv, const ProgramLimits& limits) {
  std::array<int, 2> out{}, err{};
  if (pipe2(out.data(), O_CLOEXEC) != 0 || pipe2(err.data(), O_CLOEXEC) != 0)
    throw CheckFailed(std::string("no pipe: ") + std::strerror(errno));
  prctl(PR_SET_CHILD_SUBREAPER, 1);
  const Clock::time_point start = Clock::now();
  const pid_t program = fork();
  if (program < 0) throw CheckFailed(std::string("no process: ") + std::strerror(errno));
  if (program == 0) become(argv, limits, {out[1], err[1]});
  close(out[1]);
  close(err[1]);
  ProgramOutcome outcome;
  int status = 0;
  if (!drain({out[0], err[0]}, {&outcome.out, &outcome.err}, start, limits.wall_s) ||
      !wait_for(program, start, limits.wall_s, status)) {
    outcome.timed_out = true;
    end_all(program);
    waitpid(program, &status, 0);
    end_orphans();
  }
  close(out[0]);
  close(err[0]);
  outcome.wall_s = seconds_since(start);
  if (WIFEXITED(status)) outcome.exit_code = WEXITSTATUS(status);
  if (WIFSIGNALED(status)) outcome.signal = WTERMSIG(status);
  if (outcome.signal == SIGXCPU || outcome.exit_code == 128 + SIGXCPU) outcome.timed_out = true;
  return outcome;
}

std::string own_program() { return std::filesystem::read_symlink("/proc/self/exe").string(); }

}  // namespace soda::analysis
