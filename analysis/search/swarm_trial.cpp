#include "analysis/search/swarm_trial.hpp"

#include <algorithm>
#include <iterator>

#include "analysis/runs/measured_run.hpp"
#include "analysis/runs/overrides.hpp"
#include "analysis/runs/plain_loop.hpp"
#include "kernel/api/checkers.hpp"
#include "kernel/api/hash_mix.hpp"
#include "kernel/api/invariant.hpp"
#include "kernel/phold/phold.hpp"
#include "models/run/simulation.hpp"
#include "physics/measures/measures.hpp"

namespace soda::analysis {
namespace {

using kernel::Counters;
using kernel::SplitMix64;
using kernel::Violation;

// Draws for different purposes are independent streams: a smaller size must not change the model.
enum class Purpose : std::uint64_t { kSize = 1, kModel, kCluster, kMap };

SplitMix64 stream(std::uint64_t seed, Purpose purpose) {
  return SplitMix64(kernel::append(seed, static_cast<std::uint64_t>(purpose)));
}

template <class T, std::size_t N>
T one_of(const T (&values)[N], SplitMix64& random) {
  return values[random.below(N)];
}

void require(bool holds, const std::string& what) {
  if (!holds) throw Violation(what);
}

// The rules that hold for every model.
struct KernelCheckers {
  kernel::GvtChecker gvt;
  kernel::WindowChecker window;
  kernel::ConservationChecker conservation;

  explicit KernelCheckers(std::int64_t window_t) : window(window_t) {}
};

class PholdSubject final : public SwarmSubject {
 public:
  std::string file() const override { return ""; }

  TrialSize draw_size(std::uint64_t seed) const override {
    SplitMix64 random = stream(seed, Purpose::kSize);
    TrialSize size;
    size.lps = 1 + static_cast<std::uint32_t>(random.below(12));
    size.end = 2 + static_cast<std::int64_t>(random.below(30));
    constexpr std::int64_t kWindows[] = {1, 2, 3, 5, 10, 40};
    size.window = one_of(kWindows, random);
    size.processors = 1 + static_cast<std::uint32_t>(random.below(size.lps));
    return size;
  }

  Counters run(std::uint64_t seed, const TrialSize& size,
               kernel::VirtualOptions cluster) const override {
    const kernel::PholdOptions model = draw_model(seed, size.lps);
    const kernel::VirtualTime end{size.end, 0};
    const auto oracle = kernel::make_phold(model);
    kernel::TraceRecorder recorder(oracle.size());
    const kernel::RunResult expected =
        kernel::run_sequential(kernel::observed(oracle, recorder), end);

    const auto lps = kernel::make_phold(model);
    KernelCheckers rules(size.window);
    kernel::TraceChecker trace(recorder.trace());
    kernel::ObserverList all({&rules.gvt, &rules.window, &rules.conservation, &trace});
    cluster.window = size.window;
    cluster.observer = &all;
    const kernel::RunResult found = kernel::run_virtual(lps, end, cluster).run;
    trace.on_end();  // also after a fault, when the others have nothing to say about the end
    require_equal_faults(expected, found);
    require(kernel::phold_digest(lps) == kernel::phold_digest(oracle), "the digests differ");
    require(found.counters.executed - found.counters.rolled_back >= found.counters.committed,
            "more was committed than stands");
    return found.counters;
  }

 private:
  static kernel::PholdOptions draw_model(std::uint64_t seed, std::uint32_t lps) {
    SplitMix64 random = stream(seed, Purpose::kModel);
    const auto below = [&](std::uint32_t bound) {
      return static_cast<std::uint32_t>(random.below(bound));
    };
    kernel::PholdOptions model;
    model.lps = lps;
    model.start_events_per_lp = 1 + below(3);
    model.remote_per_mille = below(1001);
    model.mean_delay = 1 + below(4);
    model.zero_delay_rounds = below(4);
    model.state_carrying_per_mille = below(700);
    model.doubled_per_mille = below(300);
    const std::uint32_t divisor = 50 + below(400);
    model.fault_divisor = below(6) == 0 ? divisor : 0;
    model.seed = seed;
    return model;
  }

  static void require_equal_faults(const kernel::RunResult& expected,
                                   const kernel::RunResult& found) {
    require(expected.fault.has_value() == found.fault.has_value(),
            expected.fault ? "a fault was lost" : "a fault was made up");
    if (!expected.fault) return;
    require(expected.fault->when == found.fault->when && expected.fault->lp == found.fault->lp &&
                expected.fault->fault.what == found.fault->fault.what,
            "another fault than the sequential run's: " + found.fault->fault.what);
  }
};

class SceneSubject final : public SwarmSubject {
 public:
  SceneSubject(const std::string& file, const Overrides& overrides)
      : file_(file), scenario_(load_scenario(file, overrides)), oracle_(scenario_) {
    centres_ = centres(scenario_.initial);
  }

  std::string file() const override { return file_; }
  std::vector<scenarios::InputWarning> warnings() const override { return scenario_.warnings; }

  TrialSize draw_size(std::uint64_t seed) const override {
    SplitMix64 random = stream(seed, Purpose::kSize);
    constexpr std::uint32_t kWorlds[] = {1, 2, 3, 4, 5, 8, 12, 24};
    constexpr std::int64_t kBuffers[] = {1, 2, 3, 5, 10, 48};
    TrialSize size;
    const auto cells = static_cast<std::uint32_t>(scenario_.territory.grid.cell_count());
    size.lps = std::min(one_of(kWorlds, random), cells);
    size.end = 1 + static_cast<std::int64_t>(
                       random.below(static_cast<std::uint64_t>(scenario_.run.steps)));
    size.window = one_of(kBuffers, random);
    size.processors = 1 + static_cast<std::uint32_t>(random.below(size.lps));
    return size;
  }

  Counters run(std::uint64_t seed, const TrialSize& size,
               kernel::VirtualOptions cluster) const override {
    SplitMix64 random = stream(seed, Purpose::kMap);
    models::TerritoryOptions territory = scenario_.territory;
    territory.worlds = size.lps;
    constexpr models::MapKind kMaps[] = {models::MapKind::kBlocks, models::MapKind::kKMeans,
                                         models::MapKind::kPaper};
    territory.map = one_of(kMaps, random);
    territory.seed = random.next();

    models::RunOptions options = draw_options(size, random);
    KernelCheckers rules(size.window);
    kernel::ObserverList all({&rules.gvt, &rules.window, &rules.conservation});
    cluster.observer = &all;
    options.cluster = cluster;
    const models::CommitObserver commits{
        .wants_states = true,
        .on_step = [&](const models::CommittedStep& step) { require_oracles_digest(step); }};
    const models::SimulationResult result = models::simulate(
        scenario_.scene, scenario_.initial,
        models::make_territory_map(territory, centres_, &scenario_.scene), options, commits);
    require(!result.fault, "a fault that the sequential run does not have");
    require(result.committed_steps == size.end,
            kernel::describe(result.committed_steps, " steps committed of ", size.end));
    return result.events;
  }

 private:
  models::RunOptions draw_options(const TrialSize& size, SplitMix64& random) const {
    using models::BalancingPolicy, models::GhostMode;
    constexpr GhostMode kGhosts[] = {GhostMode::kReceivedOnly, GhostMode::kDeadReckoning,
                                     GhostMode::kPredicted};
    constexpr BalancingPolicy kBalancing[] = {BalancingPolicy::kOff, BalancingPolicy::kOff,
                                              BalancingPolicy::kRandom, BalancingPolicy::kPaper};
    models::RunOptions options = scenario_.run;
    options.executor = models::ExecutorKind::kVirtual;
    options.steps = size.end;
    options.buffer = size.window;
    options.rollback =
        random.below(4) == 0 ? models::RollbackMode::kInvalidate : models::RollbackMode::kPropagate;
    options.gating = random.below(2) == 0;
    options.ghosts = one_of(kGhosts, random);
    options.balancing = {one_of(kBalancing, random), 1 + static_cast<std::int64_t>(random.below(5)),
                         random.next()};
    options.inputs.at_the_last_moment = random.below(2) == 0;
    options.constant_cost = random.below(2) == 0;
    return options;
  }

  void require_oracles_digest(const models::CommittedStep& step) const {
    require(physics::digest(step.ids, step.states) == oracle_.digest_after(step.step),
            kernel::describe("committed step ", step.step, " is not that of the plain loop"));
  }

  const std::string file_;
  const scenarios::Scenario scenario_;
  const PlainLoop oracle_;
  std::vector<physics::Vec3> centres_;
};

kernel::VirtualOptions draw_cluster(std::uint64_t seed, const TrialSize& size) {
  SplitMix64 random = stream(seed, Purpose::kCluster);
  constexpr std::int64_t kLatencies_ns[] = {0, 100, 1000, 20'000};
  constexpr std::int64_t kIntervals_ns[] = {500, 3000, 20'000, 200'000};
  constexpr std::uint64_t kMostActions = 500'000;
  kernel::VirtualOptions cluster;
  cluster.processors = size.processors;
  cluster.seed = seed;
  cluster.latency_ns = one_of(kLatencies_ns, random);
  cluster.jitter_ns = random.below(2) == 0 ? 0 : 2000;
  cluster.bytes_per_s = random.below(4) == 0 ? 50'000'000 : 0;
  cluster.gvt_interval_ns = one_of(kIntervals_ns, random);
  cluster.gvt_delay_ns = one_of(kLatencies_ns, random);
  cluster.check_purity = random.below(4) == 0;
  cluster.max_actions = kMostActions;
  return cluster;
}

}  // namespace

std::unique_ptr<SwarmSubject> phold_subject() { return std::make_unique<PholdSubject>(); }

std::unique_ptr<SwarmSubject> scene_subject(const std::string& file, std::int64_t most_steps,
                                            bool strict) {
  Overrides overrides;
  overrides.strict = strict;
  overrides.steps = std::min(most_steps, load_scenario(file, {}).run.steps);
  return std::make_unique<SceneSubject>(file, overrides);
}

TrialSums run_trial(const SwarmSubject& subject, const Trial& trial,
                    const std::function<void(const kernel::Decision&)>& on_decision) {
  constexpr std::int64_t kUnit_ns = 1000;
  const kernel::AdversaryPlan plan = kernel::draw_adversary(trial.seed, trial.size.lps, kUnit_ns);
  kernel::Adversary adversary = trial.decisions ? kernel::Adversary(plan, *trial.decisions)
                                                : kernel::Adversary(plan, on_decision);
  kernel::VirtualOptions cluster = draw_cluster(trial.seed, trial.size);
  cluster.adversary = &adversary;
  const Counters counters = subject.run(trial.seed, trial.size, cluster);
  return {counters.executed, counters.rolled_back, counters.committed, counters.rollbacks,
          counters.anti_messages};
}

}  // namespace soda::analysis
