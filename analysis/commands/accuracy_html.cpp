#include "analysis/commands/accuracy_html.hpp"

#include <algorithm>

#include "analysis/commands/accuracy_report.hpp"
#include "analysis/commands/accuracy_summary.hpp"
#include "analysis/process/machine.hpp"
#include "analysis/text/html_page.hpp"
#include "analysis/text/svg_plot.hpp"
#include "analysis/text/text_table.hpp"
#include "analysis/text/work_precision_plot.hpp"

namespace soda::analysis {
namespace {

std::string settings_of(const CaseRun& run) {
  return run.setting.iterations > 0 ? std::to_string(run.setting.iterations) : "own";
}

// Cells of a row that does not belong to one run.
std::string settings_html(const AccuracyReport::Case& one, const char* title) {
  return html_tag("td", title) + html_tag("td", "") + html_tag("td", "") +
         (has_tolerances(one) ? html_tag("td", "") : "");
}

std::string bound_row(const char* name, const AccuracyReport::Case& one,
                      const std::vector<ErrorColumn>& columns,
                      std::optional<double> ErrorColumn::*bound) {
  std::string cells = settings_html(one, name);
  bool any = false;
  for (const ErrorColumn& column : columns) {
    any = any || column.*bound;
    cells += html_tag("td", column.*bound ? format_number(*(column.*bound), 3) : "");
  }
  if (!any) return {};
  return html_tag("tr", cells + html_tag("td", "") + html_tag("td", ""), "bound") + "\n";
}

std::string tolerance_of(const CaseRun& run) {
  return run.setting.tolerance > 0.0 ? format_number(run.setting.tolerance, 3) : "";
}

std::string run_row(const CaseRun& run, bool with_tolerance,
                    const std::vector<ErrorColumn>& columns) {
  std::string cells =
      html_tag("td", escaped_xml(run.engine)) + html_tag("td", step_text(run.setting.dt_s)) +
      html_tag("td", settings_of(run)) + (with_tolerance ? html_tag("td", tolerance_of(run)) : "");
  for (const ErrorColumn& column : columns) {
    const JudgedMeasure* measure = find_measure(run, column);
    if (measure == nullptr) {
      cells += html_tag("td", run.fault.empty() ? "" : "no result");
      continue;
    }
    const char* kind = measure->must ? (measure->missed() ? "missed" : "reached") : "";
    cells += html_tag("td", format_number(measure->value, 3), kind);
  }
  cells += html_tag("td", format_number(run.cpu_per_simulated_s, 3)) +
           html_tag("td", format_number(run.step_ms, 3));
  return html_tag("tr", cells) + "\n";
}

std::string order_row(const AccuracyReport::Case& one, std::size_t last,
                      const std::vector<ErrorColumn>& columns) {
  std::string cells = settings_html(one, "observed order");
  bool any = false;
  for (const std::optional<double>& order : observed_orders(one, last, columns)) {
    any = any || order;
    cells += html_tag("td", order ? format_number(*order, 3) : "");
  }
  return any ? html_tag("tr", cells + html_tag("td", "") + html_tag("td", ""), "bound") + "\n"
             : std::string();
}

std::string table_of(const AccuracyReport::Case& one, const std::vector<ErrorColumn>& columns) {
  std::string head = html_tag("th", "engine") + html_tag("th", "dt, s") + html_tag("th", "sweeps");
  if (has_tolerances(one)) head += html_tag("th", "tolerance");
  for (const ErrorColumn& column : columns) head += html_tag("th", escaped_xml(column.title));
  head += html_tag("th", "CPU s/s") + html_tag("th", "step, ms");
  std::string rows = html_tag("tr", head) + "\n" +
                     bound_row("must", one, columns, &ErrorColumn::must) +
                     bound_row("stretch", one, columns, &ErrorColumn::stretch);
  for (std::size_t i = 0; i < one.runs.size(); ++i) {
    rows += run_row(one.runs[i], has_tolerances(one), columns);
    if (ends_series(one, i)) rows += order_row(one, i, columns);
  }
  return html_table(rows);
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
    if (series == plot.series.end()) series = plot.series.insert(series, {name, {}, true});
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
    std::string cells = html_tag("td", escaped_xml(run.engine)) +
                        html_tag("td", setting_text(run.setting)) +
                        html_tag("td", settings_of(run));
    for (const auto law : {&Residuals::signorini_m_s, &Residuals::complementarity_m_s,
                           &Residuals::cone_m_s, &Residuals::dissipation_m_s})
      cells += html_tag("td", format_number(run.contacts.largest.*law, 2) + " (" +
                                  format_number(run.contacts.mean(law), 2) + ")");
    rows += html_tag("tr", cells) + "\n";
  }
  if (rows.empty()) return {};
  return html_table(html_row("th", {"contacts, largest (mean), m/s", "step", "sweeps", "Signorini",
                                    "complementarity", "cone", "dissipation"}) +
                    rows);
}

std::string case_section(const AccuracyReport::Case& one) {
  const std::vector<ErrorColumn> columns = error_columns(one);
  std::string out = "<h2 id=\"" + escaped_xml(one.name) + "\">" + escaped_xml(one.name) +
                    "</h2>\n" + html_tag("p", escaped_xml(one.description)) + "\n" +
                    html_side_by_side(table_of(one, columns) + contacts_of(one));
  for (const std::string& what : one.left_out)
    out += html_tag("p", "left out: " + escaped_xml(what), "left") + "\n";
  for (const CaseRun& run : one.runs)
    if (!run.fault.empty())
      out += html_tag("p",
                      escaped_xml(run.engine + " at " + setting_text(run.setting) +
                                  " is no result: " + run.fault),
                      "left") +
             "\n";
  std::string plots;
  for (const ErrorColumn& column : columns) {
    if (column.measure == "step_ms") continue;
    const WorkPrecisionPlot plot = plot_of(one, column);
    if (!plot.series.empty()) plots += work_precision_svg(plot);
  }
  return out + html_side_by_side(plots);
}

}  // namespace

std::string accuracy_html(const AccuracyReport& report, const std::string& command) {
  std::string body =
      html_tag("p",
               "Errors are computed from states, alike for every engine. CPU time is that of the "
               "steps alone, one thread, the median of repeated runs.") +
      "\n";
  for (const std::string& what : report.missing_engines)
    body += html_tag("p", "missing engine: " + escaped_xml(what), "left") + "\n";
  body += accuracy_summary_html(report);
  body += html_tag("p",
                   "In the cases' pictures a line joins the steps of one engine, or its "
                   "tolerances; hollow points are no numbers.",
                   "left") +
          "\n";
  for (const AccuracyReport::Case& one : report.cases) body += case_section(one);
  return html_page("Error against run time", {command, machine_name()}, body);
}

}  // namespace soda::analysis
