#include "analysis/calibration/calibration_run.hpp"

#include <algorithm>
#include <limits>
#include <thread>

#include "analysis/process/machine.hpp"
#include "analysis/runs/measured_run.hpp"
#include "analysis/scaling/networks.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/stopwatch.hpp"
#include "models/cost/work_cost.hpp"

namespace soda::analysis {
namespace {

constexpr double kNsPerSecond = 1e9;

models::SimulationResult run_of(const scenarios::Scenario& scene, std::uint32_t worlds,
                                const models::RunOptions& options) {
  models::TerritoryOptions territory = scene.territory;
  territory.worlds = worlds;
  const models::TerritoryMap map =
      models::make_territory_map(territory, centres(scene.initial), &scene.scene);
  models::SimulationResult result = models::simulate(scene.scene, scene.initial, map, options);
  if (result.fault)
    throw NumericalFailure(scene.name + ", step " + std::to_string(result.fault->step) + ": " +
                           result.fault->what);
  return result;
}

// 0 threads: in sequence. `job` may be null.
models::RunOptions on_workers(const scenarios::Scenario& scene, unsigned threads,
                              kernel::Transport* job) {
  models::RunOptions options = scene.run;
  options.executor =
      threads == 0 ? models::ExecutorKind::kSequential : models::ExecutorKind::kThreads;
  options.threads = std::max(threads, 1u);
  options.transport = job;
  if (job != nullptr) options.executor = models::ExecutorKind::kMpi;
  return options;
}

// The virtual cluster with a processor for each worker.
models::RunOptions on_cluster(const scenarios::Scenario& scene, const MachineCosts& costs,
                              const Prediction& of) {
  const unsigned workers = of.threads * std::max(of.ranks, 1u);
  models::RunOptions options = scene.run;
  options.executor = models::ExecutorKind::kVirtual;
  CostFactors own;
  own.fill(of.factor);
  options.weights = models::scaled(weights_for(costs, workers), own);
  ClusterOverrides cluster;
  cluster.processors = workers;
  apply_network(network_named("shared"), cluster);
  apply_cluster(cluster, of.worlds, options.cluster);
  return options;
}

// By groups: each by itself is what work costs whose other weights are 0.
CostSample sample_of(const models::SimulationResult& result, double measured_ns) {
  CostSample sample;
  sample.measured_ns = measured_ns;
  const auto more_events = static_cast<double>(result.events.executed) - 1.0;
  for (std::size_t group = 0; group < models::kCostGroups; ++group) {
    CostFactors only{};
    only[group] = 1.0;
    models::CostWeights weights = models::scaled({}, only);
    const bool stores = group == static_cast<std::size_t>(models::CostGroup::kCheckpoints);
    if (!stores) weights.byte_ps = 0;
    const kernel::ExecutionCost cost = work_cost({}, {result.stages, {}, result.worlds},
                                                 kernel::Synchronisation::kOptimistic, weights);
    sample.modelled_ns[group] =
        static_cast<double>(cost.sum_ns() - (stores ? cost.sending_ns : 0)) +
        1e-3 * more_events * static_cast<double>(weights.event_ps);
  }
  return sample;
}

struct AloneRun {
  models::SimulationResult result;
  double cpu_ns = std::numeric_limits<double>::max();
};

// On this thread alone; the least of the times was disturbed least. The first run of a thread pays
// for its pages and caches, and may take twenty times as long: it is not measured.
AloneRun measure_alone(const scenarios::Scenario& scene, std::uint32_t worlds, int repeat) {
  const models::RunOptions options = on_workers(scene, worlds == 1 ? 0 : 1, nullptr);
  AloneRun best;
  run_of(scene, worlds, options);
  for (int i = 0; i < repeat; ++i) {
    const double begin_s = thread_cpu_s();
    best.result = run_of(scene, worlds, options);
    best.cpu_ns = std::min(best.cpu_ns, kNsPerSecond * (thread_cpu_s() - begin_s));
  }
  return best;
}

// What a thread needs for an undivided scene while the others do the same, over what it needs
// alone. Nothing gets quicker beside others: where it seems to, `alone_ns` was disturbed.
double slow_down(const scenarios::Scenario& scene, double alone_ns, unsigned processors) {
  std::vector<double> cpu_ns(processors, 0.0);
  {
    std::vector<std::jthread> threads;
    threads.reserve(cpu_ns.size());
    for (double& took_ns : cpu_ns)
      threads.emplace_back([&scene, &took_ns] { took_ns = measure_alone(scene, 1, 1).cpu_ns; });
  }
  double sum_ns = 0.0;
  for (const double took_ns : cpu_ns) {
    sum_ns += took_ns;
    alone_ns = std::min(alone_ns, took_ns);
  }
  return sum_ns / (static_cast<double>(processors) * alone_ns);
}

double median_of(std::vector<double> values) {
  std::ranges::sort(values);
  return values.empty() ? 1.0 : values[values.size() / 2];
}

}  // namespace

Calibration calibrate(const std::vector<scenarios::Scenario>& scenes, int repeat,
                      unsigned processors) {
  Calibration calibration;
  std::vector<CostSample> samples;
  std::vector<double> slow_downs, gvt_ns;
  for (const scenarios::Scenario& scene : scenes) {
    for (const std::uint32_t worlds : {1u, scene.territory.worlds}) {
      if (worlds == 1 && !samples.empty() && calibration.runs.back().scenario == scene.name)
        continue;
      const AloneRun measured = measure_alone(scene, worlds, repeat);
      samples.push_back(sample_of(measured.result, measured.cpu_ns));
      calibration.runs.push_back(
          {scene.name, worlds, measured.cpu_ns, fitted_ns(samples.back(), usual_factors()), 0.0});
      if (worlds == 1 && processors > 1)
        slow_downs.push_back(slow_down(scene, measured.cpu_ns, processors));
      const auto rounds = static_cast<double>(measured.result.events.gvt_rounds);
      if (measured.result.account && rounds > 0.0)
        gvt_ns.push_back(static_cast<double>(measured.result.account->gvt_ns) / rounds);
    }
  }
  MachineCosts& costs = calibration.costs;
  costs.machine = machine_name();
  costs.factors = fit_factors(samples);
  costs.processors = processors;
  costs.slow_down = median_of(slow_downs);
  if (!gvt_ns.empty()) costs.gvt_ns = median_of(gvt_ns);
  for (std::size_t i = 0; i < samples.size(); ++i)
    calibration.runs[i].fitted_ns = fitted_ns(samples[i], costs.factors);
  return calibration;
}

double own_factor(const scenarios::Scenario& scene, const MachineCosts& costs, int repeat) {
  const AloneRun alone = measure_alone(scene, scene.territory.worlds, repeat);
  return alone.cpu_ns / fitted_ns(sample_of(alone.result, alone.cpu_ns), costs.factors);
}

Prediction predict(const scenarios::Scenario& scene, const MachineCosts& costs, double factor,
                   unsigned threads, int repeat, kernel::Transport* job) {
  const std::uint32_t worlds = scene.territory.worlds;
  Prediction prediction{.scenario = scene.name, .worlds = worlds, .factor = factor};
  prediction.threads = std::min(threads, worlds);
  if (job != nullptr) prediction.ranks = job->size();
  const models::RunOptions measured = on_workers(scene, prediction.threads, job);
  if (job != nullptr && !job->is_root()) {
    for (int i = 0; i < repeat; ++i) run_of(scene, worlds, measured);
    return prediction;
  }
  const models::SimulationResult said = run_of(scene, worlds, on_cluster(scene, costs, prediction));
  prediction.predicted_ns = static_cast<double>(said.cluster->makespan_ns);

  std::vector<double> wall_ns;
  for (int i = 0; i < repeat; ++i) {
    const Stopwatch watch;
    const models::SimulationResult done = run_of(scene, worlds, measured);
    wall_ns.push_back(kNsPerSecond * watch.elapsed().wall_s);
    prediction.equal = prediction.equal && models::final_digest(done) == models::final_digest(said);
  }
  prediction.measured_ns = median_of(wall_ns);
  return prediction;
}

}  // namespace soda::analysis
