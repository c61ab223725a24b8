#include "analysis/commands/accuracy_html.hpp"

#include <algorithm>

#include "analysis/commands/accuracy_report.hpp"
#include "analysis/text/svg_plot.hpp"
#include "analysis/text/text_table.hpp"
#include "analysis/text/work_precision_plot.hpp"

namespace soda::analysis {
namespace {

constexpr const char* kStyle =
    "body{font-family:sans-serif;max-width:1250px;margin:1.5em auto;padding:0 1em;color:#222}\n"
    "table{border-collapse:collapse;margin:.6em 0;font-size:.85em}\n"
    "th,td{padding:.15em .7em;text-align:right;border-bottom:1px solid #ddd}\n"
    "th:first-child,td:first-child{text-align:left}\n"
    "tr.bound td{color:#555;font-style:italic}\n"
    "td.missed{color:#b00000}\n"
    "td.reached{color:#006b3c}\n"
    "p.left{color:#555;font-size:.85em;margin:.2em 0}\n"
    "div.plots{display:flex;flex-wrap:wrap;gap:8px}\n";

std::string tag(const std::string& name, const std::string& inside, const std::string& kind = "") {
  const std::string attribute = kind.empty() ? "" : " class=\"" + kind + "\"";
  return "<" + name + attribute + ">" + inside + "</" + name + ">";
}

std::string settings_of(const CaseRun& run) {
  return run.setting.iterations > 0 ? std::to_string(run.setting.iterations) : "own";
}

// Cells of a row that does not belong to one run.
std::string settings_html(const AccuracyReport::Case& one, const char* title) {
  return tag("td", title) + tag("td", "") + tag("td", "") +
         (has_tolerances(one) ? tag("td", "") : "");
}

std::string bound_row(const char* name, const AccuracyReport::Case& one,
                      const std::vector<ErrorColumn>& columns,
                      std::optional<double> ErrorColumn::*bound) {
  std::string cells = settings_html(one, name);
  bool any = false;
  for (const ErrorColumn& column : columns) {
    any = any || column.*bound;
    cells += tag("td", column.*bound ? format_number(*(column.*bound), 3) : "");
  }
  if (!any) return {};
  return tag("tr", cells + tag("td", "") + tag("td", ""), "bound") + "\n";
}

std::string tolerance_of(const CaseRun& run) {
  return run.setting.tolerance > 0.0 ? format_number(run.setting.tolerance, 3) : "";
}

std::string run_row(const CaseRun& run, bool with_tolerance,
                    const std::vector<ErrorColumn>& columns) {
  std::string cells = tag("td", escaped_xml(run.engine)) + tag("td", step_text(run.setting.dt_s)) +
                      tag("td", settings_of(run)) +
                      (with_tolerance ? tag("td", tolerance_of(run)) : "");
  for (const ErrorColumn& column : columns) {
    const JudgedMeasure* measure = find_measure(run, column);
    if (measure == nullptr) {
      cells += tag("td", run.fault.empty() ? "" : "no result");
      continue;
    }
    const char* kind = measure->must ? (measure->missed() ? "missed" : "reached") : "";
    cells += tag("td", format_number(measure->value, 3), kind);
  }
  cells += tag("td", format_number(run.cpu_per_simulated_s, 3)) +
           tag("td", format_number(run.step_ms, 3));
  return tag("tr", cells) + "\n";
}

std::string order_row(const AccuracyReport::Case& one, std::size_t last,
                      const std::vector<ErrorColumn>& columns) {
  std::string cells = settings_html(one, "observed order");
  bool any = false;
  for (const std::optional<double>& order : observed_orders(one, last, columns)) {
    any = any || order;
    cells += tag("td", order ? format_number(*order, 3) : "");
  }
  return any ? tag("tr", cells + tag("td", "") + tag("td", ""), "bound") + "\n" : std::string();
}

std::string table_of(const AccuracyReport::Case& one, const std::vector<ErrorColumn>& columns) {
  std::string head = tag("th", "engine") + tag("th", "dt, s") + tag("th", "sweeps");
  if (has_tolerances(one)) head += tag("th", "tolerance");
  for (const ErrorColumn& column : columns) head += tag("th", escaped_xml(column.title));
  head += tag("th", "CPU s/s") + tag("th", "step, ms");
  std::string rows = tag("tr", head) + "\n" + bound_row("must", one, columns, &ErrorColumn::must) +
                     bound_row("stretch", one, columns, &ErrorColumn::stretch);
  for (std::size_t i = 0; i < one.runs.size(); ++i) {
    rows += run_row(one.runs[i], has_tolerances(one), columns);
    if (ends_series(one, i)) rows += order_row(one, i, columns);
  }
  return tag("table", "\n" + rows) + "\n";
}

// The runs of one engine, and of one number of iterations, are joined: along them dt alone varies,
// or the tolerance.
WorkPrecisionPlot plot_of(const AccuracyReport::Case& one, const ErrorColumn& column) {
  WorkPrecisionPlot plot;
  plot.y_label = column.title;
  plot.must = column.must;
  plot.stretch = column.stretch;
  for (const CaseRun& run : one.runs) {
    const JudgedMeasure* measure = find_measure(run, column);
    if (measure == nullptr || !(run.cpu_per_simulated_s > 0.0)) continue;
    std::string name = run.engine;
    if (run.setting.iterations > 0) name += " " + settings_of(run);
    const bool in_mode = run.setting.tolerance > 0.0;
    if (in_mode) name += " to tolerance";
    auto series = std::find_if(plot.series.begin(), plot.series.end(),
                               [&](const WorkPrecisionSeries& s) { return s.name == name; });
    if (series == plot.series.end()) series = plot.series.insert(series, {name, {}});
    series->points.push_back(
        {run.cpu_per_simulated_s, measure->value,
         in_mode ? "tolerance " + tolerance_of(run) : "dt " + step_text(run.setting.dt_s)});
  }
  return plot;
}

std::string contacts_of(const AccuracyReport::Case& one) {
  using Residuals = physics::ContactResiduals;
  std::string rows;
  for (const CaseRun& run : one.runs) {
    if (run.contacts.points == 0) continue;
    std::string cells = tag("td", escaped_xml(run.engine)) + tag("td", setting_text(run.setting)) +
                        tag("td", settings_of(run));
    for (const auto law : {&Residuals::signorini_m_s, &Residuals::complementarity_m_s,
                           &Residuals::cone_m_s, &Residuals::dissipation_m_s})
      cells += tag("td", format_number(run.contacts.largest.*law, 2) + " (" +
                             format_number(run.contacts.mean(law), 2) + ")");
    rows += tag("tr", cells) + "\n";
  }
  if (rows.empty()) return {};
  return tag("table", "\n" +
                          tag("tr", tag("th", "contacts, largest (mean), m/s") + tag("th", "step") +
                                        tag("th", "sweeps") + tag("th", "Signorini") +
                                        tag("th", "complementarity") + tag("th", "cone") +
                                        tag("th", "dissipation")) +
                          "\n" + rows) +
         "\n";
}

std::string case_section(const AccuracyReport::Case& one) {
  const std::vector<ErrorColumn> columns = error_columns(one);
  std::string out = tag("h2", escaped_xml(one.name)) + "\n" +
                    tag("p", escaped_xml(one.description)) + "\n" + table_of(one, columns);
  for (const std::string& what : one.left_out)
    out += tag("p", "left out: " + escaped_xml(what), "left") + "\n";
  for (const CaseRun& run : one.runs)
    if (!run.fault.empty())
      out += tag("p",
                 escaped_xml(run.engine + " at " + setting_text(run.setting) +
                             " is no result: " + run.fault),
                 "left") +
             "\n";
  out += contacts_of(one);
  std::string plots;
  for (const ErrorColumn& column : columns) {
    if (column.measure == "step_ms") continue;
    const WorkPrecisionPlot plot = plot_of(one, column);
    if (!plot.series.empty()) plots += work_precision_svg(plot);
  }
  return out + "<div class=\"plots\">\n" + plots + "</div>\n";
}

}  // namespace

std::string accuracy_html(const AccuracyReport& report) {
  std::string out =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
      "<title>soda accuracy</title>\n<style>\n" +
      std::string(kStyle) + "</style></head><body>\n" + tag("h1", "Error against run time") + "\n" +
      tag("p",
          "Errors are computed from states, alike for every engine. CPU time is that of the "
          "steps alone, one thread, the median of repeated runs. A line joins the steps of "
          "one engine, or its tolerances; hollow points are no numbers.") +
      "\n";
  for (const std::string& what : report.missing_engines)
    out += tag("p", "missing engine: " + escaped_xml(what), "left") + "\n";
  for (const AccuracyReport::Case& one : report.cases) out += case_section(one);
  return out + "</body></html>\n";
}

}  // namespace soda::analysis
