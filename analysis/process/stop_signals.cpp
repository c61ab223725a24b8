#include "analysis/process/stop_signals.hpp"

#include <atomic>
#include <csignal>
#include <ctime>

namespace soda::analysis {
namespace {

constexpr int kSignals[] = {SIGINT, SIGTERM};
constexpr std::int64_t kRepeated_ns = 200'000'000;

// A handler knows nothing else.
std::atomic<kernel::StopRequest*> requested{nullptr};
std::atomic<std::int64_t> first_ns{0};
static_assert(std::atomic<kernel::StopRequest*>::is_always_lock_free &&
              kernel::StopRequest::is_always_lock_free);

std::int64_t now_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

extern "C" void take_signal(int number) {
  std::int64_t none = 0;
  if (first_ns.compare_exchange_strong(none, now_ns())) {
    std::uint32_t going_on = 0;
    if (kernel::StopRequest* const stop = requested.load())
      stop->compare_exchange_strong(going_on, static_cast<std::uint32_t>(number));
  } else if (now_ns() - none >= kRepeated_ns) {
    std::signal(number, SIG_DFL);
    std::raise(number);
  }
}

}  // namespace

const char* name_of_stop(std::uint32_t stop) {
  if (stop == SIGINT) return "SIGINT";
  if (stop == SIGTERM) return "SIGTERM";
  return "a failure";
}

StopOnSignals::StopOnSignals(kernel::StopRequest& stop) {
  first_ns = 0;
  requested = &stop;
  struct sigaction action {};
  action.sa_handler = take_signal;
  action.sa_flags = SA_RESTART;
  for (const int number : kSignals) {
    struct sigaction before {};
    sigaction(number, nullptr, &before);
    if (before.sa_handler != SIG_IGN) sigaction(number, &action, nullptr);
  }
}

StopOnSignals::~StopOnSignals() {
  for (const int number : kSignals) {
    struct sigaction now {};
    sigaction(number, nullptr, &now);
    if (now.sa_handler == take_signal) std::signal(number, SIG_DFL);
  }
  requested = nullptr;
}

}  // namespace soda::analysis
