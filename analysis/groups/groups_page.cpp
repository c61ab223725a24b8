#include <algorithm>
#include <cmath>

#include "analysis/groups/groups_report.hpp"
#include "analysis/groups/paper_scene.hpp"
#include "analysis/process/machine.hpp"
#include "analysis/text/html_page.hpp"
#include "analysis/text/svg_plot.hpp"

namespace soda::analysis {
namespace {

constexpr int kLawPoints = 200;
constexpr double kDash = 0.012;  // half the length of a mark, of the axis

double x_of(const SweepPoint& point, bool over_bodies) {
  return over_bodies ? static_cast<double>(point.bodies) : static_cast<double>(point.worlds);
}

std::string words_of_point(const SweepPoint& point) {
  return std::string("by ") + name_of(point.bond) + ", map " + name_of(point.map);
}

// Dots with bars of confidence; a dash across is what was known beforehand.
void add_class(const std::vector<SweepResult>& series, std::size_t k, bool over_bodies,
               Plot& plot) {
  PlotSeries dots{kGroupClassNames[k], false, {}};
  std::vector<PlotSeries> marks;
  for (const SweepResult& result : series) {
    const double x = x_of(result.point, over_bodies), y = 100.0 * result.shares[k].mean;
    dots.points.emplace_back(x, y);
    if (!std::isnan(result.shares[k].half_width)) {
      const double wide = 100.0 * result.shares[k].half_width;
      marks.push_back(
          {dots.name, true, {{x, std::max(0.0, y - wide)}, {x, std::min(100.0, y + wide)}}});
    }
    if (result.point.known == nullptr) continue;
    const double known = result.point.known->per_cent[k], half = kDash * plot.x_max;
    marks.push_back({dots.name, true, {{std::max(0.0, x - half), known}, {x + half, known}}});
  }
  plot.series.push_back(std::move(dots));
  std::ranges::move(marks, std::back_inserter(plot.series));
}

void add_vertical(double x, Plot& plot) {
  if (x <= plot.x_max)
    plot.series.push_back({"threshold (law)", true, {{x, 0.0}, {x, plot.y_max}}});
}

// Bodies, or worlds, at which the law has its threshold.
double law_threshold(const SweepPoint& point, bool over_bodies, double most) {
  if (over_bodies) return Percolation(point.worlds, point.map).threshold_bodies();
  const auto bodies = static_cast<double>(point.bodies);
  std::uint32_t worlds = 1;
  while (worlds < most && Percolation(worlds, point.map).threshold_bodies() < bodies) ++worlds;
  return worlds;
}

void add_law(const SweepPoint& point, bool over_bodies, Plot& plot) {
  if (point.bond != GroupBond::kOverlap) return;
  PlotSeries alone{"1 (law)", true, {}};
  for (int i = 1; i <= kLawPoints; ++i) {
    const double x = plot.x_max * i / kLawPoints;
    const double worlds = over_bodies ? point.worlds : std::round(x);
    if (worlds < 1.0) continue;
    const double bodies = over_bodies ? x : static_cast<double>(point.bodies);
    const Percolation law(static_cast<std::uint32_t>(worlds), point.map);
    alone.points.emplace_back(x, 100.0 * law.alone(bodies));
  }
  plot.series.push_back(std::move(alone));
  add_vertical(law_threshold(point, over_bodies, plot.x_max), plot);
}

Plot classes_plot(const std::vector<SweepResult>& series, bool over_bodies) {
  const SweepPoint& first = series.front().point;
  Plot plot;
  plot.title = "Worlds by the size of their group, " + words_of_point(first) + ", " +
               (over_bodies ? std::to_string(first.worlds) + " worlds"
                            : std::to_string(first.bodies) + " bodies");
  plot.x_label = over_bodies ? "bodies" : "worlds";
  plot.y_label = "% of the worlds";
  plot.x_max = 1.05 * x_of(series.back().point, over_bodies);
  plot.y_max = 100.0;
  for (const SweepResult& result : series)
    plot.x_max = std::max(plot.x_max, 1.05 * x_of(result.point, over_bodies));
  for (std::size_t k = 0; k < kGroupClasses; ++k) add_class(series, k, over_bodies, plot);
  add_law(first, over_bodies, plot);
  return plot;
}

// Where the largest group takes over, the others are largest.
Plot threshold_plot(const std::vector<SweepResult>& series) {
  const SweepPoint& first = series.front().point;
  Plot plot;
  plot.title = "The largest group and the others, " + words_of_point(first) + ", " +
               std::to_string(first.worlds) + " worlds";
  plot.x_label = "bodies";
  plot.y_label = "% or worlds";
  plot.x_max = 1.05 * static_cast<double>(series.back().point.bodies);
  plot.y_max = 100.0;
  PlotSeries largest{"largest, %", true, {}}, others{"others, worlds", true, {}};
  for (const SweepResult& result : series) {
    const auto x = static_cast<double>(result.point.bodies);
    largest.points.emplace_back(x, 100.0 * result.largest.mean);
    others.points.emplace_back(x, result.others.mean);
  }
  for (PlotSeries dots : {largest, others}) {
    plot.series.push_back(dots);
    dots.line = false;
    plot.series.push_back(std::move(dots));
  }
  if (first.bond == GroupBond::kOverlap)
    add_vertical(Percolation(first.worlds, first.map).threshold_bodies(), plot);
  return plot;
}

Plot run_plot(const BondOverTime& bond, const std::string& scenario) {
  Plot plot;
  plot.title = scenario + ": worlds by the size of their group, by " + name_of(bond.bond);
  plot.x_label = "step";
  plot.y_label = "% of the worlds";
  plot.x_max = std::max<double>(1.0, static_cast<double>(bond.steps.size()));
  plot.y_max = 100.0;
  for (std::size_t k = 0; k < kGroupClasses; ++k) {
    PlotSeries line{kGroupClassNames[k], true, {}};
    for (const StepGroups& step : bond.steps)
      line.points.emplace_back(static_cast<double>(step.step), 100.0 * step.shares[k]);
    plot.series.push_back(std::move(line));
  }
  return plot;
}

std::string page_of(const std::string& title, const std::string& command, const std::string& text,
                    const std::vector<Plot>& plots) {
  std::string pictures;
  for (const Plot& plot : plots) pictures += svg_plot(plot);
  return html_page(title, {command, machine_name()},
                   html_side_by_side(pictures) + html_tag("pre", escaped_xml(text)));
}

}  // namespace

std::string groups_html(const SweepReport& report, const std::string& command) {
  std::vector<Plot> plots;
  for (const std::vector<SweepResult>& series : series_of(report.results)) {
    if (series.size() < 2) continue;
    const bool over_bodies = series[0].point.bodies != series[1].point.bodies;
    plots.push_back(classes_plot(series, over_bodies));
    if (over_bodies) plots.push_back(threshold_plot(series));
  }
  const std::string title = "Synchronisation groups of the paper's scene";
  return page_of(report.name.empty() ? title : title + ": " + report.name, command,
                 groups_text(report), plots);
}

std::string groups_html(const RunGroupsReport& report, const std::string& command) {
  std::vector<Plot> plots;
  for (const BondOverTime& bond : report.bonds) plots.push_back(run_plot(bond, report.scenario));
  return page_of("Synchronisation groups of " + report.scenario, command, groups_text(report),
                 plots);
}

}  // namespace soda::analysis
