#include "analysis/commands/calibrate_command.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <ostream>
#include <thread>

#include "analysis/calibration/calibration_run.hpp"
#include "analysis/runs/overrides.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/json_text.hpp"
#include "analysis/text/output_file.hpp"
#include "analysis/text/progress.hpp"
#include "analysis/text/text_table.hpp"

namespace soda::analysis {
namespace {

struct CalibrateReport {
  MachineCosts costs;
  std::vector<CalibratedRun> runs;  // none if the costs were read
  std::vector<Prediction> predictions;
};

std::string in_ms(double ns) { return format_number(1e-6 * ns, 4); }

bool is_foretold(const Prediction& prediction) {
  return std::abs(prediction.ratio() - 1.0) <= kAllowed;
}

std::string costs_text(const MachineCosts& costs) {
  std::vector<std::vector<std::string>> rows;
  for (std::size_t group = 0; group < costs.factors.size(); ++group)
    rows.push_back(
        {name_of(static_cast<models::CostGroup>(group)), format_number(costs.factors[group], 3)});
  return costs.machine + "\n" +
         format_table({{"work"}, {"over the usual cost", Align::kRight}}, rows) +
         "a round of GVT: " + format_number(costs.gvt_ns, 3) + " ns a worker\n" +
         std::to_string(costs.processors) + " processors at once: work takes " +
         format_number(costs.slow_down, 3) + " times as long\n";
}

std::string runs_text(const std::vector<CalibratedRun>& runs) {
  std::vector<std::vector<std::string>> rows;
  rows.reserve(runs.size());
  for (const CalibratedRun& run : runs)
    rows.push_back({run.scenario, std::to_string(run.worlds), in_ms(run.measured_ns),
                    format_number(run.usual_ns / run.measured_ns, 3),
                    format_number(run.fitted_ns / run.measured_ns, 3)});
  return format_table({{"on one thread"},
                       {"worlds", Align::kRight},
                       {"CPU ms", Align::kRight},
                       {"usual / CPU", Align::kRight},
                       {"fitted / CPU", Align::kRight}},
                      rows);
}

std::string predictions_text(const std::vector<Prediction>& predictions) {
  const bool over_ranks = predictions.front().ranks > 0;
  std::vector<std::vector<std::string>> rows;
  for (const Prediction& of : predictions) {
    const std::string threads = std::to_string(of.threads);
    rows.push_back({of.scenario, std::to_string(of.worlds),
                    over_ranks ? std::to_string(of.ranks) + " x " + threads : threads,
                    format_number(of.factor, 3), in_ms(of.predicted_ns), in_ms(of.measured_ns),
                    format_number(of.ratio(), 3)});
  }
  const auto within = std::ranges::count_if(predictions, is_foretold);
  return format_table({{over_ranks ? "over ranks" : "over threads"},
                       {"worlds", Align::kRight},
                       {over_ranks ? "ranks x threads" : "threads", Align::kRight},
                       {"own factor", Align::kRight},
                       {"predicted ms", Align::kRight},
                       {"measured ms", Align::kRight},
                       {"ratio", Align::kRight}},
                      rows) +
         std::to_string(within) + " of " + std::to_string(predictions.size()) + " within " +
         format_number(100.0 * kAllowed) + " %\n";
}

std::string report_text(const CalibrateReport& report) {
  return costs_text(report.costs) + (report.runs.empty() ? "" : "\n" + runs_text(report.runs)) +
         (report.predictions.empty() ? "" : "\n" + predictions_text(report.predictions));
}

std::string report_json(const CalibrateReport& report) {
  JsonObject json;
  json.set("costs", machine_costs_json(report.costs));
  json.set("runs", list_of(report.runs, [](const CalibratedRun& run) {
             JsonObject line;
             return line.set("scenario", quoted(run.scenario))
                 .set("worlds", json_of(run.worlds))
                 .set("measured_s", json_of(1e-9 * run.measured_ns))
                 .set("usual_s", json_of(1e-9 * run.usual_ns))
                 .set("fitted_s", json_of(1e-9 * run.fitted_ns))
                 .text();
           }));
  json.set("predictions", list_of(report.predictions, [](const Prediction& of) {
             JsonObject line;
             return line.set("scenario", quoted(of.scenario))
                 .set("worlds", json_of(of.worlds))
                 .set("ranks", json_of(of.ranks))
                 .set("threads", json_of(of.threads))
                 .set("factor", finite_or_null(of.factor))
                 .set("predicted_s", json_of(1e-9 * of.predicted_ns))
                 .set("measured_s", json_of(1e-9 * of.measured_ns))
                 .set("ratio", finite_or_null(of.ratio()))
                 .set("equal", json_of(of.equal))
                 .text();
           }));
  return json.text() + "\n";
}

std::vector<scenarios::Scenario> load_scenes(const CalibrateRequest& request) {
  Overrides overrides;
  overrides.steps = request.steps;
  std::vector<scenarios::Scenario> scenes;
  for (const std::string& file : scenario_files(request.files, request.library))
    scenes.push_back(load_scenario(file, overrides));
  return scenes;
}

std::vector<Prediction> predictions_of(const std::vector<scenarios::Scenario>& scenes,
                                       const CalibrateRequest& request, const MachineCosts& costs) {
  const unsigned ranks = request.job == nullptr ? 1 : request.job->size();
  const bool is_root = request.job == nullptr || request.job->is_root();
  std::vector<Prediction> predictions;
  for (const scenarios::Scenario& scene : scenes) {
    const std::uint32_t worlds = scene.territory.worlds;
    const auto fits = [&](unsigned threads) { return worlds > 1 && worlds >= threads * ranks; };
    if (!std::ranges::any_of(request.threads, fits)) continue;
    const double factor = is_root ? own_factor(scene, costs, request.repeat) : 1.0;
    for (const unsigned threads : request.threads)
      if (fits(threads))
        predictions.push_back(predict(scene, costs, factor, threads, request.repeat, request.job));
  }
  return predictions;
}

}  // namespace

int calibrate_command(const CalibrateRequest& request, std::ostream& out, std::ostream& err) {
  const bool is_root = request.job == nullptr || request.job->is_root();
  if (request.job != nullptr && request.costs_file.empty())
    throw UsageError("--costs is required over ranks; measure them without mpirun");
  const std::vector<scenarios::Scenario> scenes = load_scenes(request);
  std::unique_ptr<OutputFile> file;
  if (is_root && !request.output_file.empty())
    file = std::make_unique<OutputFile>(request.output_file, request.force);
  CalibrateReport report;
  if (request.costs_file.empty()) {
    Calibration calibration =
        calibrate(scenes, request.repeat, std::max(1u, std::thread::hardware_concurrency()));
    report.costs = std::move(calibration.costs);
    report.runs = std::move(calibration.runs);
  } else {
    report.costs = read_machine_costs(request.costs_file);
  }
  report.predictions = predictions_of(scenes, request, report.costs);
  if (!is_root) return kExitOk;
  if (file) {
    file->write(machine_costs_json(report.costs));
    file->complete();
  }
  out << (request.json ? report_json(report) : report_text(report));
  if (!std::ranges::all_of(report.predictions, &Prediction::equal)) {
    err << "soda: a run on the virtual cluster ended with other bits than over threads or ranks\n";
    return kExitCheckFailed;
  }
  return request.check && !std::ranges::all_of(report.predictions, is_foretold) ? kExitCheckFailed
                                                                                : kExitOk;
}

}  // namespace soda::analysis
