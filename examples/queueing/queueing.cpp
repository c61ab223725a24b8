// A network of queues on the Time Warp kernel, without any physics.
//
// Customers arrive at each station at random, wait until they are served, and then go to another
// station or leave. The same run in sequence and over threads ends in the same states, and both
// agree with the theory (J. R. Jackson, "Networks of waiting lines", 1957).
//
// queueing [THREADS]
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <limits>
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
constexpr std::uint32_t kRoom = 1000;       // customers; more are a fault of the model
constexpr std::int64_t kNone = std::numeric_limits<std::int64_t>::max();

struct Arrival {
  static constexpr std::uint32_t kKind = 1;
  std::uint32_t from;
};

// Saved and restored by the kernel, random numbers and all.
struct Station {
  Random random;
  std::int64_t next_arrival = 0, next_departure = kNone;
  std::int64_t last_change = 0;
  std::uint64_t present = 0, served = 0;
  std::uint64_t busy_ticks = 0, customer_ticks = 0;
};

class StationProcess final : public SmallProcess<Station> {
 public:
  explicit StationProcess(std::uint32_t id) : id_(id) {
    state_.random = Random(7, id);
    state_.next_arrival = ticks(kMeanBetweenArrivals);
  }

  const Station& station() const { return state_; }

  VirtualTime next_time() const override {
    return {std::min(state_.next_arrival, state_.next_departure), 0};
  }

  void execute(VirtualTime now, std::span<const MessageView> bag, Outbox& outbox) override {
    account(now.t);
    for (const MessageView& message : bag)
      if (is<Arrival>(message)) arrive(now.t);
    if (state_.next_departure == now.t) depart(now, outbox);
    if (state_.next_arrival == now.t) {
      arrive(now.t);
      state_.next_arrival = now.t + ticks(kMeanBetweenArrivals);
    }
    // Speculative: it ends the run only if this turns out to have happened.
    if (state_.present > kRoom) throw std::overflow_error("a station is full");
  }

  void commit(VirtualTime) override {}

 private:
  std::int64_t ticks(double mean) {
    return 1 + static_cast<std::int64_t>(mean * state_.random.exponential());
  }
  void account(std::int64_t now) {
    const auto passed = static_cast<std::uint64_t>(now - state_.last_change);
    state_.customer_ticks += passed * state_.present;
    state_.busy_ticks += state_.present > 0 ? passed : 0;
    state_.last_change = now;
  }
  void arrive(std::int64_t now) {
    if (++state_.present == 1) state_.next_departure = now + ticks(kMeanService);
  }
  void depart(VirtualTime now, Outbox& outbox) {
    ++state_.served;
    state_.next_departure = --state_.present > 0 ? now.t + ticks(kMeanService) : kNone;
    if (state_.random.below(100) >= kStayPercent) return;
    const auto next = static_cast<std::uint32_t>(state_.random.below(kStations));
    send(outbox, LpId{next}, {now.t, now.round + 1}, Arrival{id_});
  }

  const std::uint32_t id_;
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
    const double time = static_cast<double>(station.last_change) * kStations;
    sums.busy += static_cast<double>(station.busy_ticks) / time;
    sums.present += static_cast<double>(station.customer_ticks) / time;
    sums.served += station.served;
    for (const std::uint64_t word : {station.served, station.busy_ticks, station.customer_ticks})
      sums.digest = append(sums.digest, word);
  }
  return sums;
}

}  // namespace

int main(int argc, char** argv) {
  const unsigned threads = argc > 1 ? static_cast<unsigned>(std::atoi(argv[1])) : 2;
  const auto alone = make_network(), together = make_network();
  raise_failure(run_sequential(alone, {kEnd, 0}));
  const RunResult run = run_threads(together, {kEnd, 0}, {.threads = threads, .window = 2000});
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
