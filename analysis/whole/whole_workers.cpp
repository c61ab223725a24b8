#include "analysis/whole/whole_workers.hpp"

#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <new>
#include <span>

#include "analysis/process/stop_signals.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/stopwatch.hpp"

namespace soda::analysis {
namespace {

// In memory that all processes share.
struct Shared {
  std::atomic<std::uint64_t> next{0};
  std::atomic<std::uint64_t> failures{0};
  std::atomic<bool> out_of_time{false};
  kernel::StopRequest stop{0};
};

struct Unmap {
  void operator()(Shared* shared) const { munmap(shared, sizeof(Shared)); }
};

std::unique_ptr<Shared, Unmap> make_shared_memory() {
  void* const memory =
      mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) throw CheckFailed(std::string("no memory: ") + std::strerror(errno));
  return std::unique_ptr<Shared, Unmap>(new (memory) Shared);
}

class Folder {
 public:
  Folder() {
    path_ = (std::filesystem::temp_directory_path() / "soda-fuzz-XXXXXX").string();
    if (mkdtemp(path_.data()) == nullptr)
      throw CheckFailed(path_ + ": cannot be made: " + std::strerror(errno));
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

void write_all(int pipe, const ByteBuffer& bytes) {
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t count = write(pipe, bytes.data() + done, bytes.size() - done);
    if (count < 0 && errno != EINTR) _exit(1);
    if (count > 0) done += static_cast<std::size_t>(count);
  }
}

// Each report: its length, the seed, the bytes.
ByteBuffer framed(std::uint64_t seed, const ByteBuffer& report) {
  ByteBuffer bytes;
  put(bytes, static_cast<std::uint64_t>(report.size()));
  put(bytes, seed);
  bytes.insert(bytes.end(), report.begin(), report.end());
  return bytes;
}
constexpr std::size_t kFrame = 16;

struct Worker {
  pid_t process = -1;
  int pipe = -1;
  ByteBuffer unread;
};

using Take = std::function<void(std::uint64_t seed, const ByteBuffer& bytes)>;

void take_whole_reports(ByteBuffer& unread, const Take& take) {
  std::size_t begin = 0;
  while (unread.size() - begin >= kFrame) {
    ByteReader head(std::span<const unsigned char>(unread).subspan(begin, kFrame));
    const std::uint64_t size = head.take<std::uint64_t>(), seed = head.take<std::uint64_t>();
    if (unread.size() - begin - kFrame < size) break;
    const auto first = unread.begin() + static_cast<std::ptrdiff_t>(begin + kFrame);
    take(seed, ByteBuffer(first, first + static_cast<std::ptrdiff_t>(size)));
    begin += kFrame + size;
  }
  unread.erase(unread.begin(), unread.begin() + static_cast<std::ptrdiff_t>(begin));
}

// Until all pipes are closed.
void collect(std::vector<Worker>& workers, const Take& take) {
  std::vector<unsigned char> chunk(65536);
  for (std::size_t open = workers.size(); open > 0;) {
    std::vector<pollfd> polled;
    polled.reserve(workers.size());
    for (const Worker& worker : workers) polled.push_back({worker.pipe, POLLIN, 0});
    if (poll(polled.data(), polled.size(), -1) < 0) continue;
    for (std::size_t i = 0; i < workers.size(); ++i) {
      if (polled[i].revents == 0) continue;
      const ssize_t count = read(workers[i].pipe, chunk.data(), chunk.size());
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) {
        close(workers[i].pipe);
        workers[i].pipe = -1;
        --open;
        continue;
      }
      workers[i].unread.insert(workers[i].unread.end(), chunk.begin(), chunk.begin() + count);
      take_whole_reports(workers[i].unread, take);
    }
  }
}

void require_good_end(const std::vector<Worker>& workers) {
  bool died = false;
  for (const Worker& worker : workers) {
    int status = 0;
    while (waitpid(worker.process, &status, 0) < 0 && errno == EINTR) continue;
    died = died || !WIFEXITED(status) || WEXITSTATUS(status) != 0;
  }
  if (died) throw CheckFailed("a process of the search died");
}

}  // namespace

std::string text_of(const SearchEnd& end) {
  if (end.stopped != 0) return std::string(" (ended early by ") + name_of_stop(end.stopped) + ")";
  return end.out_of_time ? " (out of time)" : "";
}

int exit_code_of(const SearchEnd& end, bool failed) {
  if (failed) return kExitCheckFailed;
  return end.stopped != 0 ? kExitSignal + static_cast<int>(end.stopped) : kExitOk;
}

SearchEnd share_seeds(
    const SeedRange& seeds, const WorkerLimits& limits,
    const std::function<SeedReport(std::uint64_t seed, const std::string& folder)>& work,
    const Take& take) {
  const Stopwatch stopwatch;
  const auto shared = make_shared_memory();
  const StopOnSignals stop_on_signals(shared->stop);
  const auto do_work = [&](int pipe) {
    const Folder folder;
    for (;;) {
      const std::uint64_t offset = shared->next.fetch_add(1);
      if (offset > seeds.last - seeds.first || shared->failures >= limits.most_failures) return;
      if (shared->stop != 0) return;
      if (limits.budget_s > 0.0 && stopwatch.elapsed().wall_s > limits.budget_s) {
        shared->out_of_time = true;
        return;
      }
      const SeedReport report = work(seeds.first + offset, folder.path());
      if (report.failed) ++shared->failures;
      write_all(pipe, framed(seeds.first + offset, report.bytes));
    }
  };
  std::vector<Worker> workers;
  std::fflush(nullptr);
  for (unsigned i = 0; i < limits.jobs; ++i) {
    int ends[2];
    if (pipe(ends) != 0) throw CheckFailed(std::string("no pipe: ") + std::strerror(errno));
    const pid_t process = fork();
    if (process < 0) throw CheckFailed(std::string("no process: ") + std::strerror(errno));
    if (process == 0) {
      close(ends[0]);
      prctl(PR_SET_PDEATHSIG, SIGTERM);  // nobody would read what it finds
      try {
        do_work(ends[1]);
        _exit(0);
      } catch (const std::exception& error) {
        std::fprintf(stderr, "soda: %s\n", error.what());
        _exit(1);
      }
    }
    close(ends[1]);
    workers.push_back({process, ends[0], {}});
  }
  collect(workers, take);
  require_good_end(workers);
  return {shared->out_of_time, shared->stop};
}

}  // namespace soda::analysis
