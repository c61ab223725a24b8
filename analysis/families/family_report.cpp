#include <algorithm>
#include <cmath>

#include "analysis/families/family_run.hpp"
#include "analysis/process/machine.hpp"
#include "analysis/text/html_page.hpp"
#include "analysis/text/svg_plot.hpp"
#include "analysis/text/text_table.hpp"
#include "analysis/text/work_precision_plot.hpp"

namespace soda::analysis {
namespace {

std::string miss_text(const FamilyMiss& miss) {
  const std::string kind = name_of(miss.kind);
  if (miss.kind == FamilyFinding::kFault)
    return kind + " at n " + std::to_string(miss.n) + ": " + miss.what;
  return kind + " from n " + std::to_string(miss.from_n) + " to " + std::to_string(miss.n) + ": " +
         format_number(miss.from, 3) + " to " + format_number(miss.to, 3) +
         (miss.kind == FamilyFinding::kErrorJump ? " (" + miss.measure + ")" : "");
}

// All n beyond the bound of one measure on one line.
std::string beyond_text(const std::string& measure, const std::vector<FamilyMiss>& misses) {
  std::string sizes;
  const FamilyMiss* worst = nullptr;
  for (const FamilyMiss& miss : misses) {
    if (miss.kind != FamilyFinding::kBeyondBound || miss.measure != measure) continue;
    sizes += (sizes.empty() ? "" : ", ") + std::to_string(miss.n);
    if (worst == nullptr || !(miss.to <= worst->to)) worst = &miss;
  }
  if (worst == nullptr) return {};
  return std::string(name_of(worst->kind)) + " of " + format_number(worst->from, 3) + ": at n " +
         sizes + ", most at " + std::to_string(worst->n) + ": " + format_number(worst->to, 3) +
         " (" + measure + ")";
}

std::vector<std::string> miss_lines(const FamilySeriesReport& series,
                                    const std::vector<FamilyMeasure>& measures) {
  std::vector<std::string> lines;
  for (const FamilyMeasure& measure : measures) {
    const std::string beyond = beyond_text(measure.name, series.misses);
    if (!beyond.empty()) lines.push_back("missed: " + beyond);
  }
  for (const FamilyMiss& miss : series.misses)
    if (miss.kind == FamilyFinding::kTimeJump)
      lines.push_back("told alone: " + miss_text(miss) + " us");
    else if (miss.kind != FamilyFinding::kBeyondBound)
      lines.push_back("missed: " + miss_text(miss));
  return lines;
}

std::string measure_text(const FamilyMeasure& measure) {
  return measure.name + (measure.meaning.empty() ? "" : " (" + measure.meaning + ")") + "; bound " +
         format_number(measure.bound, 3) + ", jumps count above " +
         format_number(measure.floor, 3) + ": " + measure.floor_reason;
}

std::vector<std::string> row_of(const FamilyRun& run, std::size_t measures, bool is_timed) {
  std::vector<std::string> row{std::to_string(run.n), std::to_string(run.bodies)};
  for (std::size_t i = 0; i < measures; ++i)
    row.push_back(run.fault.empty() && i < run.errors.size() ? format_number(run.errors[i], 3)
                                                             : "no result");
  if (is_timed) row.push_back(format_number(run.cpu_us, 3));
  for (const double count : {run.work, run.impacts, run.row_sweeps, run.multiplications})
    row.push_back(format_number(count, 3));
  return row;
}

std::string series_text(const FamilySeriesReport& series,
                        const std::vector<FamilyMeasure>& measures, bool is_timed) {
  std::vector<Column> columns{{"n", Align::kRight}, {"bodies", Align::kRight}};
  for (std::size_t i = 0; i < measures.size(); ++i)
    columns.push_back({"error " + std::to_string(i + 1), Align::kRight});
  if (is_timed) columns.push_back({"CPU us", Align::kRight});
  for (const char* title : {"work", "impacts", "row sweeps", "multiplications"})
    columns.push_back({title, Align::kRight});
  std::vector<std::vector<std::string>> rows;
  for (const FamilyRun& run : series.runs) rows.push_back(row_of(run, measures.size(), is_timed));
  std::string text = "  " + series.name + "\n" + format_table(columns, rows);
  for (const std::string& line : miss_lines(series, measures)) text += "  " + line + "\n";
  if (!series.left_out.empty()) text += "  left out: " + series.left_out + "\n";
  return text + "\n";
}

WorkPrecisionPlot plot_over_n(const std::string& y_label) {
  WorkPrecisionPlot plot;
  plot.y_label = y_label;
  plot.x_label = "n";
  plot.x_unit = "= n";
  return plot;
}

// What `value` says of each run, a curve for each series.
template <class Value>
std::string plot_of(const FamilyReport& family, WorkPrecisionPlot plot, Value value) {
  for (const FamilySeriesReport& series : family.series) {
    WorkPrecisionSeries line{series.name, {}, true};
    for (const FamilyRun& run : series.runs)
      if (run.fault.empty()) line.points.push_back({static_cast<double>(run.n), value(run), ""});
    if (!line.points.empty()) plot.series.push_back(std::move(line));
  }
  return plot.series.empty() ? std::string() : work_precision_svg(plot);
}

std::string plots_of(const FamilyReport& family, bool is_timed) {
  std::string plots;
  for (std::size_t i = 0; i < family.measures.size(); ++i) {
    const FamilyMeasure& measure = family.measures[i];
    WorkPrecisionPlot plot = plot_over_n(family.name + ": " + measure.name);
    plot.must = measure.bound;
    plot.must_name = "bound";
    plot.stretch = measure.floor;
    plot.stretch_name = "floor of jumps";
    plots += plot_of(family, plot, [i](const FamilyRun& run) { return run.errors[i]; });
  }
  plots += plot_of(family, plot_over_n(family.name + ": work per body and step"),
                   [](const FamilyRun& run) { return run.work; });
  if (is_timed)
    plots += plot_of(family, plot_over_n(family.name + ": CPU time per body and step, us"),
                     [](const FamilyRun& run) { return run.cpu_us; });
  return html_side_by_side(plots);
}

std::string family_html(const FamilyReport& family, bool is_timed) {
  std::string out = "<h2>" + escaped_xml(family.name) + "</h2>\n<p>" + escaped_xml(family.scene) +
                    ".</p>\n<ol>\n";
  for (const FamilyMeasure& measure : family.measures)
    out += "<li>" + escaped_xml(measure_text(measure)) + "</li>\n";
  out += "</ol>\n" + plots_of(family, is_timed);
  for (const FamilySeriesReport& series : family.series) {
    for (const std::string& line : miss_lines(series, family.measures))
      out += "<p class=\"missed\">" + escaped_xml(series.name + ": " + line) + "</p>\n";
    if (!series.left_out.empty())
      out += "<p>" + escaped_xml(series.name + ": left out: " + series.left_out) + "</p>\n";
  }
  return out;
}

}  // namespace

std::string families_text(const FamiliesReport& report) {
  std::string text =
      "costs are per body and step; work: a count of all stages, in ns of a usual "
      "machine, roughly\n\n";
  std::size_t runs = 0;
  for (const FamilyReport& family : report.families) {
    text += family.name + ": " + family.scene + "\n";
    for (std::size_t i = 0; i < family.measures.size(); ++i) {
      text += "  error " + std::to_string(i + 1) + ": " + measure_text(family.measures[i]) + "\n";
    }
    text += "\n";
    for (const FamilySeriesReport& series : family.series) {
      text += series_text(series, family.measures, report.is_timed);
      runs += series.runs.size();
    }
  }
  std::size_t left_out = 0;
  for (const FamilyReport& family : report.families)
    for (const FamilySeriesReport& series : family.series)
      left_out += series.left_out.empty() ? 0 : 1;
  return text + std::to_string(runs) + " runs, " + std::to_string(report.misses()) + " missed, " +
         std::to_string(left_out) + " series cut short by the budget\n";
}

std::string families_html(const FamiliesReport& report, const std::string& command) {
  std::string body = html_tag(
      "p",
      "Errors and costs per body and step should not change by more than a factor of two between "
      "neighbours of n. Work is a count of all stages, in ns of a usual machine, roughly. Errors "
      "of 0 are drawn at 1e-17.");
  for (const FamilyReport& family : report.families) body += family_html(family, report.is_timed);
  return html_page("Families of scenes over n", {command, machine_name()}, body);
}

}  // namespace soda::analysis
