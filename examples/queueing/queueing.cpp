// A network of queues on the Time Warp kernel, without any physics.
//
// Customers arrive at each station at random, wait until they are served, and then go to another
// station or leave. The same run in sequence and over threads ends in the same states, and both
// agree with the theory (J. R. Jackson, "Networks of waiting lines", 1957).
//
// queueing [THREADS [WINDOW]]
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <stdexcept>
#include <vector>

#include "kernel/api/executor.hpp"
#include "kernel/api/random.hpp"
#include "kernel/api/typed.hpp"
#include "kernel/time_warp/copy_history.hpp"

namespace {

using namespace soda::kernel;

constexpr std::uint32_t kStations = 16;
constexpr std::int64_t kEnd = 4'000'000;  // ticks
constexpr double kMeanService = 1000.0;   // ticks
constexpr double kMeanBetweenArrivals = 4000.0;
constexpr std::uint64_t kStayPercent = 50;  // go on to another station; the others leave
constexpr double kMostWait = 1e6;           // ticks; more is a fault of the model

// A customer brings along how long serving takes. So a station knows when it will be done with all
// who are there, and who has come last leaves then.
struct Arrival {
  static constexpr std::uint32_t kKind = 1;
  double service_ticks;
};

// Saved and restored by the kernel, random numbers and all. Sums of doubles are the same in every
// run, because a station sees its customers in the same order in every run.
struct Station {
  Random random;
  std::int64_t next_arrival = 0;
  double free_at = 0.0;  // ticks; when all who are there have been served
  std::uint64_t served = 0;
  double busy_ticks = 0.0, customer_ticks = 0.0;
};

class StationProcess final : public SmallProcess<Station> {
 public:
  explicit StationProcess(std::uint32_t id) {
    state_.random = Random(7, id);
    state_.next_arrival = ticks_until_arrival();
  }

  const Station& station() const { return state_; }

  VirtualTime next_time() const override { return {state_.next_arrival, 0}; }

  void execute(VirtualTime now, std::span<const MessageView> bag, Outbox& outbox) override {
    for (const MessageView& message : bag)
      if (is<Arrival>(message)) serve(now, read<Arrival>(message), outbox);
    if (state_.next_arrival == now.t) {
      serve(now, {service_ticks()}, outbox);
      state_.next_arrival = now.t + ticks_until_arrival();
    }
    // Speculative: it ends the run only if this turns out to have happened.
    if (state_.free_at > static_cast<double>(now.t) + kMostWait)
      throw std::overflow_error("a station is full");
  }

  void commit(VirtualTime) override {}

 private:
  std::int64_t ticks_until_arrival() {
    return 1 + static_cast<std::int64_t>(kMeanBetweenArrivals * state_.random.exponential());
  }
  double service_ticks() { return kMeanService * state_.random.exponential(); }

  void serve(VirtualTime now, const Arrival& customer, Outbox& outbox) {
    const auto since = static_cast<double>(now.t);
    state_.free_at = std::max(state_.free_at, since) + customer.service_ticks;
    state_.busy_ticks += customer.service_ticks;
    state_.customer_ticks += state_.free_at - since;
    ++state_.served;
    if (state_.random.below(100) >= kStayPercent) return;
    const auto next = static_cast<std::uint32_t>(state_.random.below(kStations));
    const auto when = static_cast<std::int64_t>(std::ceil(state_.free_at));
    send(outbox, LpId{next}, {std::max(when, now.t + 1), 0}, Arrival{service_ticks()});
  }
};

std::vector<std::unique_ptr<LogicalProcess>> make_network() {
  std::vector<std::unique_ptr<LogicalProcess>> lps;
  for (std::uint32_t i = 0; i < kStations; ++i) lps.push_back(std::make_unique<StationProcess>(i));
  return lps;
}

struct Sums {
  double busy = 0.0, present = 0.0;
  std::uint64_t digest = 0, served = 0;
};

Sums sums_of(const std::vector<std::unique_ptr<LogicalProcess>>& lps) {
  Sums sums;
  for (const auto& lp : lps) {
    const Station& station = static_cast<const StationProcess&>(*lp).station();
    const double time = static_cast<double>(kEnd) * kStations;
    sums.busy += station.busy_ticks / time;
    sums.present += station.customer_ticks / time;
    sums.served += station.served;
    sums.digest = append(sums.digest, station.served);
    for (const double sum : {station.busy_ticks, station.customer_ticks, station.free_at})
      sums.digest = append(sums.digest, std::bit_cast<std::uint64_t>(sum));
  }
  return sums;
}

}  // namespace

int main(int argc, char** argv) {
  const unsigned threads = argc > 1 ? static_cast<unsigned>(std::atoi(argv[1])) : 2;
  const std::int64_t window = argc > 2 ? std::atoll(argv[2]) : kWindowByWork;
  const auto alone = make_network(), together = make_network();
  raise_failure(run_sequential(alone, {kEnd, 0}));
  const RunResult run = run_threads(together, {kEnd, 0}, {.threads = threads, .window = window});
  raise_failure(run);

  const Sums sums = sums_of(alone), same = sums_of(together);
  // Each customer visits 1 / (1 - .5) stations on the mean.
  const double busy = kMeanService / kMeanBetweenArrivals / (1.0 - 0.01 * kStayPercent);
  const double present = busy / (1.0 - busy);
  std::printf("stations %u, served %llu, digest %016llx in sequence and %016llx over %u threads\n",
              kStations, static_cast<unsigned long long>(sums.served),
              static_cast<unsigned long long>(sums.digest),
              static_cast<unsigned long long>(same.digest), threads);
  std::printf("busy %.4f (theory %.4f), customers at a station %.4f (theory %.4f)\n", sums.busy,
              busy, sums.present, present);
  std::printf("events %llu, rolled back %llu\n",
              static_cast<unsigned long long>(run.counters.committed),
              static_cast<unsigned long long>(run.counters.rolled_back));
  const bool agrees =
      std::abs(sums.busy / busy - 1.0) < 0.03 && std::abs(sums.present / present - 1.0) < 0.10;
  return sums.digest == same.digest && agrees ? 0 : 1;
}
