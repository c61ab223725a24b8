// How far the kernel is from the limit, on PHOLD: its executors beside two probes that do the least
// that any kernel must do.
//
//   kernel_limits                  all of C1 .. C6, 5 times: medians and ratios
//   kernel_limits C1 [REPEATS]     one configuration
//   kernel_limits C1 RUN           one run: bare, bookkeeping, bookkeeping2 (two side by side),
//                                  sequential, threads1 or threads2
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <deque>
#include <limits>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include "kernel/api/executor.hpp"
#include "kernel/phold/standard_phold.hpp"

namespace {

using soda::kernel::kTicksPerUnit;
using soda::kernel::phold_configurations;
using soda::kernel::PholdConfiguration;
using soda::kernel::PholdDraw;
using soda::kernel::PholdDraws;

constexpr std::uint32_t kNone = ~0u;

struct Event {
  std::int64_t t;
  std::uint32_t round;
  std::uint32_t destination;
  std::uint32_t source;
  std::uint32_t slot;
  std::uint64_t token;
  std::uint32_t next;
  std::uint32_t next_sent;
};

// Events in a pool, lists of them in buckets about two events wide, the current bucket sorted by
// the full key. Its parameters fit PHOLD's delays: nothing is adapted while it runs.
class BucketQueue {
 public:
  explicit BucketQueue(std::size_t events) {
    while ((kTicksPerUnit >> shift_) * 2 > static_cast<std::int64_t>(4 * events) && shift_ < 20)
      ++shift_;
    std::size_t buckets = 1;
    while (buckets < static_cast<std::size_t>(16 * (kTicksPerUnit >> shift_))) buckets *= 2;
    heads_.assign(buckets, kNone);
    pool_.reserve(events);
  }

  std::uint32_t push(const Event& event) {
    std::uint32_t place = free_;
    if (place == kNone) {
      place = static_cast<std::uint32_t>(pool_.size());
      pool_.push_back(event);
    } else {
      free_ = pool_[place].next;
      pool_[place] = event;
    }
    const std::int64_t bucket = event.t >> shift_;
    if (bucket <= bucket_) {
      insert(place);
    } else {
      std::uint32_t& head = heads_[static_cast<std::size_t>(bucket) & (heads_.size() - 1)];
      pool_[place].next = head;
      head = place;
    }
    return place;
  }

  std::uint32_t pop() {
    while (current_.empty()) {
      ++bucket_;
      std::uint32_t* link = &heads_[static_cast<std::size_t>(bucket_) & (heads_.size() - 1)];
      while (*link != kNone) {
        const std::uint32_t place = *link;
        if ((pool_[place].t >> shift_) == bucket_) {
          *link = pool_[place].next;
          insert(place);
        } else {
          link = &pool_[place].next;
        }
      }
    }
    const std::uint32_t place = current_.back();
    current_.pop_back();
    return place;
  }

  void release(std::uint32_t place) {
    pool_[place].next = free_;
    free_ = place;
  }

  void link_sent(std::uint32_t& head, std::uint32_t sent) {
    pool_[sent].next_sent = head;
    head = sent;
  }

  const Event& operator[](std::uint32_t place) const { return pool_[place]; }

 private:
  static auto key(const Event& e) {
    return std::tie(e.t, e.round, e.destination, e.source, e.slot);
  }

  void insert(std::uint32_t place) {
    std::size_t at = current_.size();
    current_.push_back(place);
    for (; at > 0 && key(pool_[current_[at - 1]]) < key(pool_[place]); --at)
      current_[at] = current_[at - 1];
    current_[at] = place;
  }

  int shift_ = 0;
  std::int64_t bucket_ = 0;
  std::vector<std::uint32_t> heads_;
  std::vector<Event> pool_;
  std::uint32_t free_ = kNone;
  std::vector<std::uint32_t> current_;  // latest first
};

void start(const PholdConfiguration& c, const PholdDraws& draws, BucketQueue& queue) {
  for (std::uint32_t lp = 0; lp < c.model.lps; ++lp)
    for (std::uint32_t i = 0; i < c.model.start_events_per_lp; ++i) {
      const std::uint64_t token = draws.first_token(lp, i);
      queue.push({draws.draw(token, 0).delay_ticks, 0, lp, lp, i, token, kNone, kNone});
    }
}

Event follower(const Event& event, const PholdDraws& draws) {
  const PholdDraw draw = draws.draw(event.token, event.destination);
  return {event.t + draw.delay_ticks,
          0,
          draw.destination,
          event.destination,
          0,
          draw.next_token,
          kNone,
          kNone};
}

struct Outcome {
  std::uint64_t events = 0;
  std::uint64_t digest = 0;
  double efficiency = 1.0;
};

// A queue, the random draws, and nothing else.
Outcome run_bare(const PholdConfiguration& c) {
  const PholdDraws draws(c.model);
  BucketQueue queue(std::size_t{c.model.lps} * c.model.start_events_per_lp);
  start(c, draws, queue);
  const auto end = static_cast<std::int64_t>(c.end_units * static_cast<double>(kTicksPerUnit));
  Outcome outcome;
  while (true) {
    const std::uint32_t place = queue.pop();
    const Event event = queue[place];
    if (event.t >= end) return outcome;
    ++outcome.events;
    outcome.digest += event.token;
    queue.release(place);
    queue.push(follower(event, draws));
  }
}

struct State {
  std::uint64_t words[4] = {};
};

struct Processed {
  State before;
  std::uint32_t event;
  std::uint32_t first_sent;  // the head of its cause list, linked by Event::next_sent
};

struct History {
  State state;
  std::deque<Processed> processed;  // in order of time
  bool touched = false;
};

// Gives back what lies before `gvt`; true if something is left.
bool reclaim(History& history, std::int64_t gvt, BucketQueue& queue) {
  while (!history.processed.empty() && queue[history.processed.front().event].t < gvt) {
    queue.release(history.processed.front().event);
    history.processed.pop_front();
  }
  return !history.processed.empty();
}

// The same, with what Time Warp has to keep: for each event the state before it, the event itself
// and the list of what it sent, in a queue of each LP, reclaimed every 4096 events up to the time
// reached.
Outcome run_bookkeeping(const PholdConfiguration& c) {
  const PholdDraws draws(c.model);
  BucketQueue queue(std::size_t{c.model.lps} * c.model.start_events_per_lp);
  start(c, draws, queue);
  const auto end = static_cast<std::int64_t>(c.end_units * static_cast<double>(kTicksPerUnit));
  std::vector<History> histories(c.model.lps);
  std::vector<std::uint32_t> touched;
  Outcome outcome;
  while (true) {
    const std::uint32_t place = queue.pop();
    const Event event = queue[place];
    if (event.t >= end) break;
    ++outcome.events;
    History& history = histories[event.destination];
    const std::uint32_t sent = queue.push(follower(event, draws));
    history.processed.push_back({history.state, place, kNone});
    queue.link_sent(history.processed.back().first_sent, sent);
    if (!history.touched) touched.push_back(event.destination);
    history.touched = true;
    history.state.words[0] += event.token;
    ++history.state.words[1];
    if (outcome.events % 4096 != 0) continue;
    std::size_t kept = 0;
    for (const std::uint32_t lp : touched) {
      histories[lp].touched = reclaim(histories[lp], event.t, queue);
      if (histories[lp].touched) touched[kept++] = lp;
    }
    touched.resize(kept);
  }
  for (const History& history : histories) outcome.digest += history.state.words[0];
  return outcome;
}

// Two of them side by side that share nothing: what two processors of this machine can give.
Outcome run_bookkeeping_twice(const PholdConfiguration& c) {
  Outcome other;
  std::thread thread([&] { other = run_bookkeeping(c); });
  Outcome outcome = run_bookkeeping(c);
  thread.join();
  outcome.events += other.events;
  return outcome;
}

struct Measured {
  Outcome outcome;
  double wall_s = 0.0;
  double cpu_s = 0.0;

  double events() const { return static_cast<double>(outcome.events); }
};

// Both clocks, from construction on.
class Clocks {
 public:
  void stop(Measured& measured) const {
    measured.wall_s =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - wall_).count();
    measured.cpu_s = static_cast<double>(std::clock() - cpu_) / CLOCKS_PER_SEC;
  }

 private:
  std::chrono::steady_clock::time_point wall_ = std::chrono::steady_clock::now();
  std::clock_t cpu_ = std::clock();
};

Measured measure(const PholdConfiguration& c, const std::string& what) {
  Measured measured;
  if (what == "bare" || what == "bookkeeping" || what == "bookkeeping2") {
    const Clocks clocks;
    measured.outcome = what == "bare"          ? run_bare(c)
                       : what == "bookkeeping" ? run_bookkeeping(c)
                                               : run_bookkeeping_twice(c);
    clocks.stop(measured);
  } else {
    const auto lps = soda::kernel::make_standard_phold(c.model);
    const soda::kernel::VirtualTime end{
        static_cast<std::int64_t>(c.end_units * static_cast<double>(kTicksPerUnit)), 0};
    soda::kernel::ThreadsOptions options{.threads = what == "threads2" ? 2u : 1u,
                                         .window = std::numeric_limits<std::int64_t>::max()};
    const bool windowed = std::string(c.name) == "C6";
    if (windowed) options.window = 2 * kTicksPerUnit;
    const Clocks clocks;
    const soda::kernel::RunResult run = what == "sequential"
                                            ? soda::kernel::run_sequential(lps, end)
                                            : soda::kernel::run_threads(lps, end, options);
    clocks.stop(measured);
    const soda::kernel::StandardPholdResult result = soda::kernel::standard_phold_result(lps);
    measured.outcome = {
        result.events, result.digest,
        static_cast<double>(run.counters.committed) / static_cast<double>(run.counters.executed)};
  }
  return measured;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

// Rates of what runs in one thread are per second of processor time, for the machine may be busy;
// those of two threads, and of one beside them, per second. False if executors disagree.
bool table_row(const PholdConfiguration& c, int repeats) {
  const std::vector<std::string> runs = {"bare",     "bookkeeping", "sequential",
                                         "threads1", "threads2",    "bookkeeping2"};
  std::vector<std::vector<double>> per_cpu_s(runs.size());
  std::vector<std::vector<double>> per_s(runs.size());
  std::vector<Outcome> outcomes(runs.size());
  for (int repeat = 0; repeat < repeats; ++repeat) {
    for (std::size_t i = 0; i < runs.size(); ++i) {
      const Measured measured = measure(c, runs[i]);
      per_cpu_s[i].push_back(1e-6 * measured.events() / measured.cpu_s);
      per_s[i].push_back(1e-6 * measured.events() / measured.wall_s);
      outcomes[i] = measured.outcome;
    }
  }
  const auto cpu = [&](std::size_t i) { return median(per_cpu_s[i]); };
  const auto wall = [&](std::size_t i) { return median(per_s[i]); };
  const auto best = [&](std::size_t i) {
    return *std::max_element(per_s[i].begin(), per_s[i].end());
  };
  std::printf(
      "| %s | %lu | %.1f | %.1f | %.2f | %.2f | %.2f | %.2f | %.2f | %.2f | %.2f | %.2f | %.1f %% "
      "|",
      c.name, static_cast<unsigned long>(outcomes[2].events), cpu(0), cpu(1), cpu(2), cpu(3),
      wall(4), cpu(2) / cpu(0), cpu(3) / cpu(1), wall(4) / wall(3), best(4) / best(3),
      best(5) / best(1), 100.0 * outcomes[4].efficiency);
  std::printf(" %016lx |\n", static_cast<unsigned long>(outcomes[2].digest));
  std::fflush(stdout);
  return outcomes[2].digest == outcomes[3].digest && outcomes[2].digest == outcomes[4].digest &&
         outcomes[0].events == outcomes[2].events;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string only = argc > 1 ? argv[1] : "";
  const std::string what = argc > 2 ? argv[2] : "5";
  const int repeats = std::atoi(what.c_str());
  if (repeats > 0)
    std::printf(
        "M events/s, medians of %d; a, b: the probes, 2b: two of b side by side\n"
        "| | events | a | b | seq. | 1 thr. | 2 thr. | seq./a | 1/b | 2/1 | best 2/1 | best 2b/b |"
        " eff. | digest |\n",
        repeats);
  bool agree = true;
  for (const PholdConfiguration& c : phold_configurations()) {
    if (!only.empty() && only != c.name) continue;
    if (repeats > 0) {
      agree = table_row(c, repeats) && agree;
      continue;
    }
    const Measured measured = measure(c, what);
    std::printf("%lu events, %.2f M/s of processor time, digest %016lx, efficiency %.3f\n",
                static_cast<unsigned long>(measured.outcome.events),
                1e-6 * measured.events() / measured.cpu_s,
                static_cast<unsigned long>(measured.outcome.digest), measured.outcome.efficiency);
  }
  if (!agree) std::puts("executors disagree");
  return agree ? 0 : 1;
}
