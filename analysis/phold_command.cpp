#include "analysis/phold_command.hpp"

#include <cmath>
#include <limits>
#include <ostream>
#include <sstream>

#include "analysis/exit_codes.hpp"
#include "analysis/json_output.hpp"
#include "analysis/measured_run.hpp"
#include "analysis/stopwatch.hpp"
#include "analysis/text_table.hpp"

namespace soda::analysis {
namespace {

// Units that fit into ticks with room to spare.
constexpr double kMostUnits = 0x1p40;

std::int64_t ticks_of(double units, const char* option) {
  if (!(units > 0.0 && units <= kMostUnits))
    throw UsageError(std::string(option) + ": must be above 0 and at most 2^40");
  return static_cast<std::int64_t>(std::ceil(units * static_cast<double>(kernel::kTicksPerUnit)));
}

std::string report_text(const PholdRequest& request, const PholdRun& run) {
  std::ostringstream text;
  text.precision(4);
  text << run.result.events << " events committed in " << run.wall_s << " s, "
       << 1e-6 * run.events_per_s() << " M events/s (" << request.executor;
  if (request.executor == "threads") text << ", " << request.threads << " threads";
  text << ")\nefficiency " << 100.0 * efficiency(run.counters) << " %, " << run.counters.rollbacks
       << " rollbacks, " << run.counters.anti_messages << " anti-messages, "
       << run.counters.gvt_rounds << " GVT rounds\ndigest " << format_digest(run.result.digest)
       << "\n";
  return text.str();
}

}  // namespace

PholdRun run_phold(const PholdRequest& request) {
  const kernel::VirtualTime end{ticks_of(request.end_units, "--end"), 0};
  kernel::ThreadsOptions options{.threads = request.threads,
                                 .window = std::numeric_limits<std::int64_t>::max()};
  if (request.window_units != 0.0) options.window = ticks_of(request.window_units, "--window");
  const auto lps = kernel::make_standard_phold(request.model);
  const Stopwatch watch;
  kernel::RunResult run;
  if (request.executor == "sequential")
    run = kernel::run_sequential(lps, end);
  else if (request.executor == "threads")
    run = kernel::run_threads(lps, end, options);
  else
    throw UsageError("--executor: " + request.executor + " is not sequential or threads");
  const double wall_s = watch.elapsed().wall_s;
  return {run.counters, kernel::standard_phold_result(lps), wall_s};
}

int phold_command(const PholdRequest& request, std::ostream& out) {
  const PholdRun run = run_phold(request);
  out << (request.json ? phold_json(request, run) : report_text(request, run));
  return kExitOk;
}

}  // namespace soda::analysis
