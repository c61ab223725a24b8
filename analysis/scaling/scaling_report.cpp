#include "analysis/scaling/scaling_report.hpp"

#include <algorithm>
#include <cmath>

#include "analysis/process/machine.hpp"
#include "analysis/runs/run_report.hpp"
#include "analysis/text/html_page.hpp"
#include "analysis/text/svg_plot.hpp"
#include "analysis/text/text_table.hpp"

namespace soda::analysis {
namespace {

struct ScalingTable {
  std::vector<Column> columns;
  std::vector<std::vector<std::string>> rows;
};

std::vector<Column> scaling_columns(const ScalingPoint& point) {
  const auto right = [](std::string title) { return Column{std::move(title), Align::kRight}; };
  std::vector<Column> columns = {{"scene"},
                                 right("steps"),
                                 right("bodies"),
                                 right("worlds"),
                                 right("one processor ms"),
                                 right("makespan ms"),
                                 right("speed-up"),
                                 right("efficiency %")};
  for (auto [name, ns] : account_terms(point.cluster.account)) {
    std::ranges::replace(name, '_', ' ');
    columns.push_back(right(name + " %"));
  }
  for (const auto& [rival, ns] : point.rivals_ns) columns.push_back(right(name_of(rival)));
  return columns;
}

double percent(std::int64_t part_ns, const ScalingPoint& point) {
  const std::int64_t all_ns = std::max<std::int64_t>(point.cluster.account.sum_ns(), 1);
  return 100.0 * static_cast<double>(part_ns) / static_cast<double>(all_ns);
}

std::vector<std::string> scaling_row(const ScalingCurve& curve, const ScalingPoint& point) {
  const auto milliseconds = [](std::int64_t ns) {
    return format_number(1e-6 * static_cast<double>(ns));
  };
  std::vector<std::string> row = {curve.scenario,
                                  std::to_string(curve.steps),
                                  std::to_string(point.bodies),
                                  std::to_string(point.worlds),
                                  milliseconds(point.one_processor_ns),
                                  milliseconds(point.cluster.makespan_ns),
                                  format_number(point.speed_up(), 3),
                                  format_number(100.0 * point.efficiency(), 3)};
  for (const auto& [name, ns] : account_terms(point.cluster.account))
    row.push_back(format_number(percent(ns, point), 3));
  for (const auto& [rival, ns] : point.rivals_ns)
    row.push_back(format_number(point.speed_up_of(ns), 3));
  return row;
}

ScalingTable scaling_table(const ScalingReport& report) {
  ScalingTable table;
  for (const ScalingCurve& curve : report.curves) {
    for (const ScalingPoint& point : curve.points) {
      if (table.columns.empty()) table.columns = scaling_columns(point);
      table.rows.push_back(scaling_row(curve, point));
    }
  }
  return table;
}

std::string heading(const ScalingReport& report) {
  const bool weak = !report.curves.empty() && report.curves.front().weak;
  return std::string(weak ? "one copy of the scene for each world" : "one scene for all worlds") +
         ", a processor for each world; network " + report.network.name + ": " +
         format_number(report.latency_us) + " us, " + format_number(report.bandwidth_mb_s) +
         " MB/s\nspeed-up: over one world on one processor; the columns with % from \"useful\" on "
         "are shares of processors x makespan\n";
}

std::string left_out_text(const ScalingReport& report) {
  std::string text;
  for (const ScalingCurve& curve : report.curves)
    if (!curve.left_out.empty())
      text += "left out: " + curve.scenario + ", " + curve.left_out + "\n";
  return text;
}

std::string unequal_text(const ScalingReport& report) {
  std::string text;
  for (const ScalingCurve& curve : report.curves)
    for (const ScalingPoint& point : curve.points)
      if (!point.equal)
        text += "other bits than the undivided run: " + curve.scenario + ", " +
                std::to_string(point.worlds) + " worlds\n";
  return text;
}

// Over powers of ten of worlds.
double exponent_of(const ScalingPoint& point) { return std::log10(point.worlds); }

Plot empty_plot(const ScalingCurve& curve, const std::string& what) {
  Plot plot{.title = curve.scenario + ", " + std::to_string(curve.steps) + " steps: " + what,
            .x_label = "log10 of the number of worlds",
            .y_label = "",
            .x_max = std::max(exponent_of(curve.points.back()), 0.1),
            .y_max = 100.0,
            .series = {}};
  return plot;
}

// What is below 1 is not drawn.
Plot speed_up_plot(const ScalingCurve& curve) {
  Plot plot = empty_plot(curve, "speed-up");
  plot.y_label = "log10 of the speed-up";
  plot.y_max = plot.x_max;
  PlotSeries own{"soda", true, {}};
  for (const ScalingPoint& point : curve.points)
    if (point.speed_up() >= 1.0)
      own.points.emplace_back(exponent_of(point), std::log10(point.speed_up()));
  plot.series.push_back(own);
  for (std::size_t i = 0; i < curve.points.front().rivals_ns.size(); ++i) {
    PlotSeries rival{name_of(curve.points.front().rivals_ns[i].first), true, {}};
    for (const ScalingPoint& point : curve.points)
      if (const double gain = point.speed_up_of(point.rivals_ns[i].second); gain >= 1.0)
        rival.points.emplace_back(exponent_of(point), std::log10(gain));
    plot.series.push_back(rival);
  }
  plot.series.push_back({"ideal", true, {{0.0, 0.0}, {plot.x_max, plot.x_max}}});
  return plot;
}

// The terms two by two, so that six colours are enough.
Plot account_plot(const ScalingCurve& curve) {
  Plot plot = empty_plot(curve, "where processors' time goes");
  plot.y_label = "% of processors x makespan";
  const std::vector<std::pair<std::string, std::vector<std::string>>> groups = {
      {"useful", {"useful"}},           {"replicated", {"replicated"}},
      {"division", {"division"}},       {"Time Warp", {"checkpoints", "gvt", "sending"}},
      {"rolled back", {"rolled_back"}}, {"waiting", {"waiting"}}};
  for (const auto& [name, terms] : groups) {
    PlotSeries series{name, true, {}};
    for (const ScalingPoint& point : curve.points) {
      std::int64_t sum_ns = 0;
      for (const auto& [term, ns] : account_terms(point.cluster.account))
        if (std::ranges::find(terms, term) != terms.end()) sum_ns += ns;
      series.points.emplace_back(exponent_of(point), percent(sum_ns, point));
    }
    plot.series.push_back(series);
  }
  return plot;
}

}  // namespace

std::string scaling_text(const ScalingReport& report) {
  const ScalingTable table = scaling_table(report);
  std::string text = heading(report) + "\n";
  if (!table.rows.empty()) text += format_table(table.columns, table.rows);
  return text + left_out_text(report) + unequal_text(report);
}

std::string scaling_csv(const ScalingReport& report) {
  const ScalingTable table = scaling_table(report);
  std::string text;
  const auto add = [&text](std::string cell, bool first) {
    std::ranges::replace(cell, ',', ';');
    text += (first ? "" : ",") + cell;
  };
  for (std::size_t i = 0; i < table.columns.size(); ++i) add(table.columns[i].title, i == 0);
  text += "\n";
  for (const std::vector<std::string>& row : table.rows) {
    for (std::size_t i = 0; i < row.size(); ++i) add(row[i], i == 0);
    text += "\n";
  }
  return text;
}

std::string scaling_html(const ScalingReport& report, const std::string& command) {
  const ScalingTable table = scaling_table(report);
  std::vector<std::string> titles;
  for (const Column& column : table.columns) titles.push_back(column.title);
  std::string rows = html_row("th", titles);
  for (const std::vector<std::string>& row : table.rows) rows += html_row("td", row);
  std::string plots;
  for (const ScalingCurve& curve : report.curves)
    if (curve.points.size() > 1)
      plots += svg_plot(speed_up_plot(curve)) + svg_plot(account_plot(curve));
  return html_page("Scaling", {command, machine_name()},
                   html_paragraphs(heading(report) +
                                   "Source of the network's figures: " + report.network.source) +
                       html_side_by_side(plots) + html_table(rows) +
                       html_paragraphs(left_out_text(report) + unequal_text(report)));
}

}  // namespace soda::analysis
