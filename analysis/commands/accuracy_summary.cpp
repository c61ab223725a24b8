#include "analysis/commands/accuracy_summary.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "analysis/commands/accuracy_report.hpp"
#include "analysis/text/html_page.hpp"
#include "analysis/text/svg_plot.hpp"
#include "analysis/text/text_table.hpp"
#include "analysis/text/work_precision_plot.hpp"

namespace soda::analysis {
namespace {

constexpr std::size_t kWorstShown = 10;

double share_of_must(const JudgedMeasure& measure) {
  if (!std::isfinite(measure.value)) return std::numeric_limits<double>::infinity();
  if (measure.value == 0.0) return 0.0;
  return measure.value / *measure.must;  // over 0: infinite
}

std::vector<std::string> engines_in(const AccuracyReport& report) {
  std::vector<std::string> engines;
  for (const AccuracyReport::Case& one : report.cases)
    for (const CaseRun& run : one.runs)
      if (std::ranges::find(engines, run.engine) == engines.end()) engines.push_back(run.engine);
  return engines;
}

bool reaches_all(const CaseRun& run) {
  const std::optional<double> share = largest_share_of_must(run);
  return share && *share <= 1.0;
}

bool is_cheapest(const AccuracyReport::Case& one, const CaseRun& best,
                 const std::vector<std::string>& engines) {
  return std::ranges::all_of(engines, [&](const std::string& engine) {
    const CaseRun* const other = best_run(one, engine);
    return other == &best || other == nullptr || !reaches_all(*other) ||
           best.cpu_per_simulated_s < other->cpu_per_simulated_s;
  });
}

EngineSummary summary_of(const std::string& engine, const std::vector<std::string>& engines,
                         const AccuracyReport& report) {
  EngineSummary summary;
  summary.engine = engine;
  std::vector<double> costs;
  for (const AccuracyReport::Case& one : report.cases) {
    const CaseRun* const best = best_run(one, engine);
    if (best == nullptr) continue;
    ++summary.cases;
    const double share = *largest_share_of_must(*best);
    if (summary.worst_case.empty() || share > summary.worst_share) {
      summary.worst_case = one.name;
      summary.worst_share = share;
    }
    if (share > 1.0) continue;
    ++summary.reached;
    summary.cheapest += is_cheapest(one, *best, engines);
    costs.push_back(best->cpu_per_simulated_s);
  }
  if (costs.empty()) return summary;
  std::ranges::sort(costs);
  summary.median_cpu_s = costs[costs.size() / 2];
  return summary;
}

std::string engines_table(const AccuracyReport& report) {
  std::string rows =
      html_row("th", {"engine", "cases", "reached all bounds", "cheapest of these",
                      "CPU s/s, median", "farthest from its bound", "times its bound"});
  for (const EngineSummary& s : engine_summaries(report))
    rows += html_row(
        "td", {s.engine, std::to_string(s.cases), std::to_string(s.reached),
               std::to_string(s.cheapest), s.reached > 0 ? format_number(s.median_cpu_s, 3) : "",
               s.worst_case, format_number(s.worst_share, 3)});
  return html_table(rows);
}

std::string best_runs_picture(const AccuracyReport& report) {
  WorkPrecisionPlot plot;
  plot.y_label = "largest error over its bound, best run of each case";
  plot.must = 1.0;
  for (const std::string& engine : engines_in(report)) {
    WorkPrecisionSeries series{engine, {}, false};
    for (const AccuracyReport::Case& one : report.cases) {
      const CaseRun* const best = best_run(one, engine);
      if (best == nullptr || !(best->cpu_per_simulated_s > 0.0)) continue;
      series.points.push_back({best->cpu_per_simulated_s, *largest_share_of_must(*best),
                               one.name + ", " + setting_text(best->setting)});
    }
    if (!series.points.empty()) plot.series.push_back(std::move(series));
  }
  if (plot.series.empty()) return {};
  return html_tag("figure",
                  work_precision_svg(plot) +
                      html_tag("figcaption",
                               "Below the line all bounds of a case are reached. A point is the "
                               "cheapest run that does, or else the nearest; point at it for its "
                               "case."));
}

// Runs of soda, those farthest from a must first.
std::string farthest_table(const AccuracyReport& report) {
  struct Far {
    const CaseRun* run;
    const JudgedMeasure* measure;
    double share;
  };
  std::vector<Far> all;
  for (const AccuracyReport::Case& one : report.cases)
    for (const CaseRun& run : one.runs)
      for (const JudgedMeasure& measure : run.measures)
        if (run.engine == "soda" && measure.must)
          all.push_back({&run, &measure, share_of_must(measure)});
  std::ranges::stable_sort(all, std::ranges::greater{}, &Far::share);
  std::string rows = html_row("th", {"soda: case", "step", "measure", "error", "bound", "share"});
  for (const Far& far : std::span(all).first(std::min(all.size(), kWorstShown))) {
    std::string cells;
    for (const std::string& text :
         {far.run->scene, setting_text(far.run->setting), far.measure->measure,
          format_number(far.measure->value, 3), format_number(*far.measure->must, 3)})
      cells += html_tag("td", escaped_xml(text));
    cells += html_tag("td", format_number(far.share, 3), far.share > 1.0 ? "missed" : "reached");
    rows += html_tag("tr", cells) + "\n";
  }
  return all.empty() ? std::string() : html_table(rows);
}

// Of other programs that reach all bounds of a case, those for which soda needs more time.
std::string ahead_table(const AccuracyReport& report) {
  std::string rows;
  for (const std::string& engine : engines_in(report)) {
    if (is_soda(engine)) continue;
    for (const AccuracyReport::Case& one : report.cases) {
      const CaseRun *const other = best_run(one, engine), *const own = best_run(one, "soda");
      if (other == nullptr || own == nullptr || !reaches_all(*other)) continue;
      const double times = own->cpu_per_simulated_s / other->cpu_per_simulated_s;
      if (reaches_all(*own) && !(times > 1.0)) continue;
      rows += html_row("td", {one.name, engine, format_number(other->cpu_per_simulated_s, 3),
                              reaches_all(*own) ? format_number(times, 3) + " times as long"
                                                : "misses a bound"});
    }
  }
  if (rows.empty()) return {};
  return html_table(html_row("th", {"faster than soda: case", "engine", "CPU s/s", "soda"}) + rows);
}

std::string links_to_cases(const AccuracyReport& report) {
  std::string links;
  for (const AccuracyReport::Case& one : report.cases)
    links += (links.empty() ? "" : " · ") +
             ("<a href=\"#" + escaped_xml(one.name) + "\">" + escaped_xml(one.name) + "</a>");
  return html_tag("p", links) + "\n";
}

}  // namespace

std::optional<double> largest_share_of_must(const CaseRun& run) {
  std::optional<double> largest;
  for (const JudgedMeasure& measure : run.measures)
    if (measure.must) largest = std::max(largest.value_or(0.0), share_of_must(measure));
  return run.fault.empty() ? largest : std::nullopt;
}

const CaseRun* best_run(const AccuracyReport::Case& one, const std::string& engine) {
  const auto is_better = [](const CaseRun& a, const CaseRun& b) {
    const bool reaches = reaches_all(a);
    if (reaches != reaches_all(b)) return reaches;
    if (reaches) return a.cpu_per_simulated_s < b.cpu_per_simulated_s;
    return *largest_share_of_must(a) < *largest_share_of_must(b);
  };
  const CaseRun* best = nullptr;
  for (const CaseRun& run : one.runs)
    if (run.engine == engine && largest_share_of_must(run) &&
        (best == nullptr || is_better(run, *best)))
      best = &run;
  return best;
}

std::vector<EngineSummary> engine_summaries(const AccuracyReport& report) {
  const std::vector<std::string> engines = engines_in(report);
  std::vector<EngineSummary> all;
  all.reserve(engines.size());
  for (const std::string& engine : engines) all.push_back(summary_of(engine, engines, report));
  return all;
}

std::string accuracy_summary_html(const AccuracyReport& report) {
  return html_tag("h2", "Summary") + "\n" + engines_table(report) +
         html_side_by_side(best_runs_picture(report) + farthest_table(report) +
                           ahead_table(report)) +
         links_to_cases(report);
}

}  // namespace soda::analysis
