#include "analysis/commands/phold_command.hpp"

#include <cmath>
#include <limits>
#include <ostream>
#include <sstream>
#include <tuple>
#include <utility>

#include "analysis/commands/json_output.hpp"
#include "analysis/runs/measured_run.hpp"
#include "analysis/runs/run_report.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/stopwatch.hpp"
#include "analysis/text/text_table.hpp"
#include "kernel/api/wire.hpp"
#include "kernel/executors/distributed_executor.hpp"

namespace soda::analysis {
namespace {

// Units that fit into ticks with room to spare.
constexpr double kMostUnits = 0x1p40;

std::int64_t ticks_of(double units, const char* option) {
  if (!(units > 0.0 && units <= kMostUnits))
    throw UsageError(std::string(option) + ": must be above 0 and at most 2^40");
  return static_cast<std::int64_t>(std::ceil(units * static_cast<double>(kernel::kTicksPerUnit)));
}

// Of the LPs of all ranks, at the root.
kernel::StandardPholdResult gathered_result(
    kernel::Transport& transport, unsigned threads,
    const std::vector<std::unique_ptr<kernel::LogicalProcess>>& lps) {
  const kernel::LpRange own = kernel::own_lps(transport, threads, lps.size());
  kernel::Bytes bytes;
  for (std::uint32_t lp = own.first; lp < own.last; ++lp)
    kernel::append_plain(bytes, kernel::standard_phold_part(*lps[lp]));
  std::vector<kernel::StandardPholdPart> parts;
  for (const kernel::Bytes& of_rank : transport.gather(bytes))
    for (std::span<const std::byte> left(of_rank); !left.empty();)
      parts.push_back(kernel::take_plain<kernel::StandardPholdPart>(left));
  return kernel::join(parts);
}

std::string report_text(const PholdRequest& request, const PholdRun& run) {
  std::ostringstream text;
  text.precision(4);
  text << run.result.events << " events committed in " << run.wall_s << " s, "
       << 1e-6 * run.events_per_s() << " M events/s (" << request.executor;
  if (request.transport != nullptr) text << ", " << request.transport->size() << " ranks";
  if (request.executor == "threads" || request.executor == "mpi")
    text << ", " << request.threads << " threads";
  if (request.policy == kernel::Synchronisation::kLockstep) text << ", lockstep";
  text << ")\nefficiency " << 100.0 * efficiency(run.counters) << " %, " << run.counters.rollbacks
       << " rollbacks, " << run.counters.anti_messages << " anti-messages, "
       << run.counters.gvt_rounds << " GVT rounds\ndigest " << format_digest(run.result.digest)
       << "\n";
  if (run.cluster) text << "\n" << cluster_text(*run.cluster, run.one_processor_ns());
  return text.str();
}

void require_matching_options(const PholdRequest& request) {
  if ((request.executor == "mpi") != (request.transport != nullptr))
    throw UsageError("--executor mpi and mpirun belong together: mpirun -n RANKS soda phold ...");
  if (request.cluster.given() && request.executor != "virtual")
    throw UsageError(
        "--processors, --latency-us and the like: they belong to the virtual executor; allowed: "
        "--executor virtual");
  if (request.policy && request.executor == "sequential")
    throw UsageError(
        "--policy: the sequential executor has none; allowed: --executor threads, mpi or virtual");
}

std::pair<kernel::RunResult, kernel::VirtualReport> run_on_cluster(
    std::span<const std::unique_ptr<kernel::LogicalProcess>> lps, kernel::VirtualTime end,
    const kernel::VirtualOptions& cluster) {
  kernel::VirtualResult result = kernel::run_virtual(lps, end, cluster);
  return {std::move(result.run), result.report};
}

}  // namespace

PholdRun run_phold(const PholdRequest& request) {
  require_matching_options(request);
  const kernel::VirtualTime end{ticks_of(request.end_units, "--end"), 0};
  kernel::ThreadsOptions options{.threads = request.threads,
                                 .window = std::numeric_limits<std::int64_t>::max()};
  if (request.window_units != 0.0) options.window = ticks_of(request.window_units, "--window");
  options.synchronisation = request.policy.value_or(options.synchronisation);
  kernel::VirtualOptions cluster{.window = options.window,
                                 .synchronisation = options.synchronisation};
  apply_cluster(request.cluster, request.model.lps, cluster);
  const auto lps = kernel::make_standard_phold(request.model);
  const Stopwatch watch;
  kernel::RunResult run;
  std::optional<kernel::VirtualReport> report;
  if (request.executor == "sequential")
    run = kernel::run_sequential(lps, end);
  else if (request.executor == "threads")
    run = kernel::run_threads(lps, end, options);
  else if (request.executor == "mpi")
    run = kernel::run_distributed(lps, end, options, *request.transport);
  else if (request.executor == "virtual")
    std::tie(run, report) = run_on_cluster(lps, end, cluster);
  else
    throw UsageError("--executor: " + request.executor +
                     " is not sequential, threads, mpi or virtual");
  const double wall_s = watch.elapsed().wall_s;
  if (request.executor == "mpi")
    return {run.counters, gathered_result(*request.transport, request.threads, lps), wall_s};
  return {run.counters, kernel::standard_phold_result(lps), wall_s, report};
}

int phold_command(const PholdRequest& request, std::ostream& out) {
  const PholdRun run = run_phold(request);
  if (request.transport != nullptr && !request.transport->is_root()) return kExitOk;
  out << (request.json ? phold_json(request, run) : report_text(request, run));
  return kExitOk;
}

}  // namespace soda::analysis
