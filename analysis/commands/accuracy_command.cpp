#include "analysis/commands/accuracy_command.hpp"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <optional>
#include <ostream>

#include "analysis/commands/accuracy_html.hpp"
#include "analysis/commands/accuracy_report.hpp"
#include "analysis/commands/json_output.hpp"
#include "analysis/commands/search_json.hpp"
#include "analysis/families/family_run.hpp"
#include "analysis/measures/extremes.hpp"
#include "analysis/process/installed.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/nearest_name.hpp"
#include "analysis/text/output_file.hpp"
#include "analysis/text/text_table.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::analysis {
namespace {

namespace fs = std::filesystem;

constexpr double kLeastStep_s = 1e-6, kMostStep_s = 1.0;  // as in scenario files
constexpr double kShortBudget_s = 3.0;  // of a scene of a family, unless all n are asked for
constexpr double kLeastTolerance = 1e-12, kMostTolerance = 1e-2;

std::optional<double> number_of(std::string_view text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

// "0.01" or "1/60".
double step_of(const std::string& text) {
  const std::size_t slash = text.find('/');
  std::optional<double> value = number_of(std::string_view(text).substr(0, slash));
  if (value && slash != std::string::npos) {
    const std::optional<double> below = number_of(std::string_view(text).substr(slash + 1));
    value = below ? std::optional(*value / *below) : std::nullopt;
  }
  if (!value || !(*value >= kLeastStep_s && *value <= kMostStep_s))
    throw UsageError("--dt: found " + text + "; allowed: 1e-6 to 1 s, as 0.01 or 1/60");
  return *value;
}

// Soda's own cases mean what they say.
std::vector<FileWarnings> news_among(std::vector<FileWarnings> warnings) {
  const std::string own = installed(kOwnCases);
  std::erase_if(warnings, [&own](const FileWarnings& of) {
    return fs::path(of.file).parent_path() == fs::path(own);
  });
  return warnings;
}

}  // namespace

std::vector<std::string> case_names(const std::string& folder) {
  std::error_code error;
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (entry.path().extension() == ".json") names.push_back(entry.path().stem().string());
  if (error) throw scenarios::FileError(folder + ": cannot be read: " + error.message());
  std::sort(names.begin(), names.end());
  return names;
}

namespace {

std::vector<std::string> files_of(const AccuracyRequest& request) {
  std::vector<std::string> files;
  const std::string folder = installed(request.folder);
  const auto in_folder = [&](const std::string& name) {
    return (fs::path(folder) / (name + ".json")).string();
  };
  if (request.cases.empty())
    for (const std::string& name : case_names(folder)) files.push_back(in_folder(name));
  for (const std::string& name : request.cases) {
    if (name.ends_with(".json")) {
      files.push_back(installed(name));
      continue;
    }
    const std::vector<std::string> known = case_names(folder);
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      const std::string nearest = nearest_name(name, known);
      std::string what = "no case " + name;
      what += " in " + folder + (nearest.empty() ? "" : " (did you mean " + nearest + "?)");
      throw UsageError(what);
    }
    files.push_back(in_folder(name));
  }
  return files;
}

// The engines that were asked for; those that are not in this build are named in the report.
std::vector<EngineKind> engines_of(const AccuracyRequest& request, AccuracyReport& report) {
  const std::vector<EngineKind> built = engine_kinds();
  const std::vector<PeerModule> peers = peer_modules();
  std::vector<EngineKind> engines;
  for (const std::string& name : request.engines) {
    const auto known = std::find_if(built.begin(), built.end(),
                                    [&](const EngineKind& kind) { return kind.name == name; });
    if (known != built.end()) {
      engines.push_back(*known);
      continue;
    }
    const auto peer = std::find_if(peers.begin(), peers.end(),
                                   [&](const PeerModule& m) { return name.starts_with(m.name); });
    if (peer == peers.end())
      throw UsageError("--engines: found " + name +
                       "; allowed: soda, soda-fast, soda-accurate, soda-fcl, soda-own, bullet, "
                       "ode, ode-direct, mujoco");
    report.missing_engines.push_back(name + " (not in this build: install " + peer->package +
                                     " and build again)");
  }
  return engines;
}

std::vector<double> steps_of(const AccuracyRequest& request, double own_s) {
  std::vector<double> steps;
  for (const std::string& text : request.steps_s) steps.push_back(step_of(text));
  if (steps.empty()) steps.push_back(own_s);
  if (request.sweep)
    for (int halvings = 0; halvings < 4; ++halvings) steps.push_back(0.5 * steps.back());
  return steps;
}

// Settings from coarse to fine.
using Series = std::vector<EngineSetting>;

std::vector<Series> series_of(const AccuracyRequest& request, bool has_accuracy_mode,
                              double own_s) {
  const std::vector<int> own{0};
  const bool in_mode = has_accuracy_mode && !request.tolerances.empty();
  const bool in_steps = !in_mode || !request.steps_s.empty() || request.sweep;
  std::vector<Series> all;
  for (const int iterations : request.iterations.empty() ? own : request.iterations) {
    if (in_steps) {
      Series& steps = all.emplace_back();
      for (const double dt_s : steps_of(request, own_s)) steps.push_back({dt_s, iterations});
    }
    if (in_mode) {
      Series& mode = all.emplace_back();
      for (const double tolerance : request.tolerances)
        mode.push_back({own_s, iterations, tolerance});
    }
  }
  return all;
}

// All settings of one engine; what would take too long is left out.
void run_settings(const scenarios::Scenario& scenario, const EngineKind& engine,
                  const AccuracyRequest& request, AccuracyReport::Case& result) {
  const double duration_s = static_cast<double>(scenario.run.steps) * scenario.scene.dt_s;
  for (const Series& series : series_of(request, is_soda(engine.name), scenario.scene.dt_s)) {
    double step_s = 0.0;  // what one took at the setting before
    for (const EngineSetting& setting : series) {
      const bool too_long = step_s * duration_s / setting.dt_s > request.timing.budget_s;
      if (!too_long) result.runs.push_back(run_case(scenario, engine, setting, request.timing));
      if (too_long || result.runs.back().given_up) {
        result.left_out.push_back(engine.name + " at " + setting_text(setting) +
                                  ": beyond the time budget");
        if (!too_long) result.runs.pop_back();
        break;  // finer settings take longer
      }
      step_s = 1e-3 * result.runs.back().step_ms;
    }
  }
}

// Those that are named, in that order; all if none is.
std::vector<Family> families_of(const std::vector<std::string>& names) {
  std::vector<Family> all = all_families();
  if (names.empty()) return all;
  std::vector<std::string> known;
  known.reserve(all.size());
  for (const Family& family : all) known.push_back(family.name);
  std::vector<Family> families;
  for (const std::string& name : names) {
    const auto found = std::ranges::find(all, name, &Family::name);
    if (found == all.end()) {
      const std::string nearest = nearest_name(name, known);
      throw UsageError("no family " + name +
                       (nearest.empty() ? "" : " (did you mean " + nearest + "?)"));
    }
    families.push_back(*found);
  }
  return families;
}

int families_command(const AccuracyRequest& request, std::ostream& out, std::ostream& err) {
  FamilyRequest how;
  how.full = request.full;
  how.timing.repeats = request.timing.repeats;
  how.timing.budget_s =
      request.full ? request.timing.budget_s : std::min(request.timing.budget_s, kShortBudget_s);
  const std::vector<Family> families = families_of(request.cases);
  std::optional<OutputFile> html;
  if (!request.html_file.empty()) html.emplace(request.html_file, request.force);
  const FamiliesReport report = measure_families(families, how, err);
  if (html) {
    html->write(families_html(report, request.command));
    html->complete();
  }
  out << (request.json ? families_json(report) : families_text(report));
  return request.check && report.misses() > 0 ? kExitCheckFailed : kExitOk;
}

}  // namespace

std::size_t AccuracyReport::missed() const {
  std::size_t count = 0;
  for (const Case& one : cases)
    for (const CaseRun& run : one.runs) {
      if (run.engine != "soda") continue;
      count += run.fault.empty() ? 0 : 1;
      for (const JudgedMeasure& measure : run.measures) count += measure.missed() ? 1 : 0;
    }
  return count;
}

AccuracyReport measure_accuracy(const AccuracyRequest& request, std::ostream& progress) {
  AccuracyReport report;
  const std::vector<EngineKind> engines = engines_of(request, report);
  std::vector<scenarios::Scenario> scenes;
  for (const std::string& file : files_of(request)) {
    scenes.push_back(scenarios::read_scenario_file(file));
    if (scenes.back().references.empty())
      throw UsageError(file + ": has no references to compare with");
    if (request.strict) refuse_warnings(file, scenes.back().warnings);
    report.warnings.push_back({file, scenes.back().warnings});
  }
  tell_warnings(news_among(report.warnings), progress);
  for (const scenarios::Scenario& scenario : scenes) {
    progress << "soda accuracy: " << scenario.name << "\n" << std::flush;
    AccuracyReport::Case& result = report.cases.emplace_back();
    result.name = scenario.name;
    result.description = scenario.description;
    for (const EngineKind& engine : engines) {
      const std::string why = engine.cannot(scenario.scene);
      if (why.empty())
        run_settings(scenario, engine, request, result);
      else
        result.left_out.push_back(engine.name + ": " + why);
    }
  }
  return report;
}

int accuracy_command(const AccuracyRequest& request, std::ostream& out, std::ostream& err) {
  if (request.full && !request.families) throw UsageError("--full: needs --families");
  if (request.extremes) {
    if (request.families) throw UsageError("--extremes: not together with --families");
    if (!request.cases.empty()) throw UsageError("--extremes: has no cases");
    const ExtremesReport report = measure_extremes(extreme_settings());
    out << (request.json ? extremes_json(report) : extremes_text(report));
    return request.check && report.beyond(kExtremesMust) > 0 ? kExitCheckFailed : kExitOk;
  }
  if (request.timing.repeats < 0 || request.timing.repeats > 1000)
    throw UsageError("--repeat: allowed: 0 (no timing) to 1000");
  if (request.families) return families_command(request, out, err);
  for (const double tolerance : request.tolerances)
    if (!(tolerance >= kLeastTolerance && tolerance <= kMostTolerance))
      throw UsageError("--tolerance: found " + format_number(tolerance) +
                       "; allowed: 1e-12 to 0.01");
  for (const int iterations : request.iterations)
    if (iterations < 1 || iterations > 1000)
      throw UsageError("--iterations: found " + std::to_string(iterations) +
                       "; allowed: 1 to 1000");
  std::optional<OutputFile> html;
  if (!request.html_file.empty()) html.emplace(request.html_file, request.force);
  const AccuracyReport report = measure_accuracy(request, err);
  if (html) {
    html->write(accuracy_html(report, request.command));
    html->complete();
  }
  out << (request.json ? accuracy_json(report) : accuracy_text(report));
  return request.check && report.missed() > 0 ? kExitCheckFailed : kExitOk;
}

}  // namespace soda::analysis
