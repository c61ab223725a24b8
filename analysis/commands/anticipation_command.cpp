#include "analysis/commands/anticipation_command.hpp"

#include <unistd.h>

#include <charconv>
#include <cstdio>
#include <ostream>

#include "analysis/anticipation/anticipation_report.hpp"
#include "analysis/runs/warnings.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/output_file.hpp"
#include "analysis/text/text_table.hpp"
#include "scenarios/format.hpp"

namespace soda::analysis {
namespace {

template <class T>
void require_in(T value, T least, T most, const char* option) {
  if (value >= least && value <= most) return;
  throw UsageError(std::string(option) + ": found " + format_number(static_cast<double>(value)) +
                   "; allowed: " + format_number(static_cast<double>(least)) + " to " +
                   format_number(static_cast<double>(most), 7));
}

void check(const AnticipationOptions& options) {
  for (const std::int64_t buffer : options.buffers)
    require_in(buffer, std::int64_t{1}, scenarios::kMaxBufferEntries, "--buffers");
  for (const double overload : options.overloads) require_in(overload, 0.0, 100.0, "--overloads");
  require_in(options.utilisation, 1e-6, 10.0, "--utilisation");
  require_in(options.frames_per_s, 0.1, 1e5, "--fps");
  require_in(options.speed, 1e-3, 1e3, "--speed");
  if (options.lead_frames) require_in(*options.lead_frames, 1.0, 1e6, "--lead");
  require_in(options.repeat, 1, 1000, "--repeat");
  require_in(options.max_steps, std::int64_t{1}, scenarios::kMaxSteps, "--max-steps");
}

[[noreturn]] void refuse_peak(const std::string& text) {
  throw UsageError("--peak: found " + text +
                   "; allowed: WORLDS@FROM[+FOR], as 0,2@1.5+2 or all@1, or random:SEED");
}

template <class T>
T number_of(const std::string& part, const std::string& text) {
  T value{};
  const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), value);
  if (error != std::errc() || end != part.data() + part.size()) refuse_peak(text);
  return value;
}

// Rewrites a line on a terminal.
class Counting {
 public:
  explicit Counting(bool quiet) : shows_(!quiet && isatty(STDERR_FILENO) != 0) {}
  ~Counting() {
    if (shows_) std::fputs("\r\x1b[K", stderr);
  }
  void operator()(std::size_t done, std::size_t of) const {
    if (shows_) std::fprintf(stderr, "\r\x1b[Krun %zu of %zu", done + 1, of);
  }

 private:
  const bool shows_;
};

std::string workers_text(const scenarios::Scenario& scenario) {
  const models::RunOptions& run = scenario.run;
  if (run.executor == models::ExecutorKind::kVirtual)
    return std::to_string(run.cluster.processors) + " virtual processors";
  if (run.executor == models::ExecutorKind::kMpi)
    return std::to_string(run.transport->size()) + " ranks of " + std::to_string(run.threads) +
           (run.threads == 1 ? " thread" : " threads");
  const unsigned threads = run.executor == models::ExecutorKind::kThreads ? run.threads : 1;
  return std::to_string(threads) + (threads == 1 ? " thread" : " threads");
}

scenarios::Scenario scenario_of(const AnticipationRequest& request, std::ostream& err) {
  Overrides overrides = request.overrides;
  if (!request.file.empty()) {
    scenarios::Scenario scenario = load_scenario(request.file, overrides);
    tell_warnings({{request.file, scenario.warnings}}, err);
    return scenario;
  }
  scenarios::Scenario scenario = idle_scene(overrides.worlds.value_or(1));
  apply_overrides(overrides, scenario.territory, scenario.run);
  if (!scenario.run.constant_cost) scenario.run.cluster.bag_cost_ns = 0;
  scenario.run.constant_cost = true;
  return scenario;
}

// One world, cubes that are added after a second, buffers of up to 48 entries.
void as_in_the_paper(AnticipationRequest& request) {
  request.options.buffers = {1, 12, 24, 48};
  request.options.overloads = {0.1, 0.25, 0.5, 1.0, 1.5};
}

int show_buffer_costs(const AnticipationRequest& request, scenarios::Scenario scenario,
                      AnticipationHead head, OutputFile* page, std::ostream& out) {
  if (scenario.run.executor != models::ExecutorKind::kVirtual) {
    Overrides on_cluster = request.overrides;
    on_cluster.executor = models::ExecutorKind::kVirtual;
    on_cluster.threads.reset();
    apply_overrides(on_cluster, scenario.territory, scenario.run);
  }
  head.workers = workers_text(scenario);
  const std::vector<BufferCost> costs =
      makespan_over_buffers(scenario, request.options.buffers, Counting(request.quiet));
  if (page != nullptr) {
    page->write(buffer_costs_html(head, costs));
    page->complete();
  }
  if (request.json)
    out << buffer_costs_json(head.scene, costs);
  else if (request.csv)
    out << buffer_costs_csv(costs);
  else
    out << head.scene << ": " << head.worlds << " worlds on " << head.workers << "\n\n"
        << buffer_costs_text(costs);
  return kExitOk;
}

int show_points(const AnticipationRequest& request, const scenarios::Scenario& scenario,
                const AnticipationHead& head, OutputFile* page, std::ostream& out) {
  const std::vector<AnticipationPoint> points =
      anticipation(scenario, head.options, Counting(request.quiet));
  if (page != nullptr) {
    page->write(anticipation_html(head, points));
    page->complete();
  }
  if (request.json)
    out << anticipation_json(head, points);
  else if (request.csv)
    out << anticipation_csv(points);
  else
    out << anticipation_text(head, points);
  return kExitOk;
}

}  // namespace

PeakOptions peak_of(const std::string& text, std::uint32_t worlds) {
  PeakOptions peak;
  if (text.rfind("random:", 0) == 0) {
    peak.wandering = number_of<std::uint64_t>(text.substr(7), text);
    return peak;
  }
  const std::size_t at = text.find('@');
  if (at == std::string::npos) refuse_peak(text);
  const std::string who = text.substr(0, at), when = text.substr(at + 1);
  for (std::size_t begin = 0; who != "all" && begin <= who.size();) {
    const std::size_t end = std::min(who.find(',', begin), who.size());
    const auto world = number_of<std::uint32_t>(who.substr(begin, end - begin), text);
    if (world >= worlds)
      throw UsageError("--peak: found world " + std::to_string(world) + "; allowed: 0 to " +
                       std::to_string(worlds - 1));
    peak.worlds.push_back(models::WorldId{world});
    begin = end + 1;
  }
  const std::size_t plus = when.find('+');
  peak.from_s = number_of<double>(when.substr(0, plus), text);
  if (plus != std::string::npos) peak.for_s = number_of<double>(when.substr(plus + 1), text);
  if (!(peak.from_s >= 0.0 && peak.from_s <= 1e6 && peak.for_s > 0.0)) refuse_peak(text);
  return peak;
}

int anticipation_command(const AnticipationRequest& given, std::ostream& out, std::ostream& err) {
  AnticipationRequest request = given;
  if (request.paper) as_in_the_paper(request);
  AnticipationOptions& options = request.options;
  check(options);
  const scenarios::Scenario scenario = scenario_of(request, err);
  require_paceable(scenario.run);
  options.peak = peak_of(request.peak, scenario.territory.worlds);
  options.measured = request.mode == "measured" || request.mode == "all";
  options.modelled = request.mode == "modelled" || request.mode == "all";
  if (options.measured && scenario.run.executor == models::ExecutorKind::kVirtual)
    throw UsageError("--mode: a run on the virtual cluster cannot be measured; allowed: modelled");
  if (request.over_makespan && request.overrides.transport != nullptr)
    throw UsageError("--over makespan: it runs on the virtual cluster; start it without mpirun");
  const AnticipationHead head{.scene = request.file.empty() ? "an idle scene" : scenario.name,
                              .worlds = scenario.territory.worlds,
                              .workers = workers_text(scenario),
                              .options = options,
                              .peak = request.peak,
                              .command = request.command};
  if (const kernel::Transport* const job = request.overrides.transport;
      job != nullptr && !job->is_root()) {
    anticipation(scenario, options, [](std::size_t, std::size_t) {});
    return kExitOk;
  }
  std::unique_ptr<OutputFile> page;
  if (!request.report_file.empty())
    page = std::make_unique<OutputFile>(request.report_file, request.force);
  if (request.over_makespan) return show_buffer_costs(request, scenario, head, page.get(), out);
  return show_points(request, scenario, head, page.get(), out);
}

}  // namespace soda::analysis
