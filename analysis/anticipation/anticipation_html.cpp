// The page of `soda anticipation`: pictures first, then the table. No scripts, no network.
#include <algorithm>
#include <array>
#include <cmath>

#include "analysis/anticipation/anticipation_report.hpp"
#include "analysis/process/machine.hpp"
#include "analysis/text/html_page.hpp"
#include "analysis/text/svg_plot.hpp"
#include "analysis/text/text_table.hpp"

namespace soda::analysis {
namespace {

double largest_overload(const std::vector<AnticipationPoint>& points) {
  double largest = 0.1;
  for (const AnticipationPoint& point : points) largest = std::max(largest, point.overload);
  return 1.1 * largest;
}

void add_dots(const std::string& name, std::int64_t buffer,
              const std::vector<AnticipationPoint>& points,
              std::optional<AnticipationRun> AnticipationPoint::*run, Plot& plot) {
  PlotSeries dots{name, false, {}};
  for (const AnticipationPoint& point : points)
    if (point.buffer == buffer && point.*run && (point.*run)->late)
      dots.points.emplace_back(point.overload, static_cast<double>((point.*run)->steps));
  if (!dots.points.empty()) plot.series.push_back(std::move(dots));
}

Plot figure(const AnticipationHead& head, const std::vector<AnticipationPoint>& points) {
  Plot plot;
  plot.title = "Steps until a frame is late: law (lines), runs (dots)";
  plot.x_label = "overload (fraction of the base cost)";
  plot.y_label = "steps until late";
  plot.x_max = largest_overload(points);
  plot.y_max = 10.0;
  for (const AnticipationPoint& point : points)
    if (point.law > 0 && point.law <= head.options.max_steps)
      plot.y_max = std::max(plot.y_max, 1.1 * static_cast<double>(point.law));
  for (const std::int64_t buffer : head.options.buffers) {
    const std::string name = "B = " + std::to_string(buffer);
    PlotSeries law{name, true, {}};
    constexpr int kPoints = 200;
    for (const AnticipationPoint& point : points) {
      if (point.buffer != buffer) continue;
      // The ratio grows straight with the overload, as one point of it and that of none tell.
      const double slope = point.overload > 0.0 ? (point.ratio - head.options.utilisation) /
                                                      (point.overload * head.options.utilisation)
                                                : 1.0;
      for (int i = 1; i <= kPoints && law.points.size() < kPoints && point.overload > 0.0; ++i) {
        const double overload = plot.x_max * i / kPoints;
        const double steps = models::anticipation_steps(
            static_cast<double>(buffer), head.options.utilisation * (1.0 + slope * overload));
        if (std::isfinite(steps)) law.points.emplace_back(overload, steps);
      }
    }
    plot.series.push_back(std::move(law));
    add_dots(name, buffer, points, &AnticipationPoint::modelled, plot);
    add_dots(name, buffer, points, &AnticipationPoint::measured, plot);
  }
  return plot;
}

// From light (short) to dark blue (long), on a logarithmic scale up to 1e5 steps.
std::string colour_of(double steps) {
  if (!std::isfinite(steps)) return "#222";
  const double share = std::clamp(std::log10(std::max(steps, 1.0)) / 5.0, 0.0, 1.0);
  const auto mix = [share](int from, int to) {
    return std::to_string(from + static_cast<int>(share * (to - from)));
  };
  return "rgb(" + mix(247, 8) + "," + mix(251, 48) + "," + mix(255, 107) + ")";
}

std::string surface() {
  constexpr int kColumns = 60, kRows = 41, kCell = 10, kLeft = 60, kTop = 30;
  constexpr double kMostOverload = 3.0;
  const int width = kLeft + kColumns * kCell + 20, height = kTop + kRows * kCell + 50;
  std::string svg = "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 " +
                    std::to_string(width) + " " + std::to_string(height) +
                    "' font-family='sans-serif' font-size='12'>";
  for (int row = 0; row < kRows; ++row)
    for (int column = 0; column < kColumns; ++column) {
      const double buffer = std::exp2(10.0 * (kRows - 1 - row) / (kRows - 1));
      const double overload = kMostOverload * (column + 1) / kColumns;
      const double steps = models::anticipation_steps(std::round(buffer), 1.0 + overload);
      svg += "<rect x='" + std::to_string(kLeft + column * kCell) + "' y='" +
             std::to_string(kTop + row * kCell) + "' width='10.5' height='10.5' fill='" +
             colour_of(steps) + "'><title>B " + format_number(std::round(buffer)) + ", overload " +
             format_number(overload) + ": " + format_number(std::floor(steps + 1e-6), 6) +
             " steps</title></rect>";
    }
  const auto label = [&svg](int x, int y, const std::string& text, const char* anchor) {
    svg += "<text x='" + std::to_string(x) + "' y='" + std::to_string(y) + "' text-anchor='" +
           anchor + "'>" + text + "</text>";
  };
  for (int power = 0; power <= 10; power += 2)
    label(kLeft - 6, kTop + (kRows - 1) * kCell * (10 - power) / 10 + 10,
          std::to_string(1 << power), "end");
  for (int tick = 1; tick <= 3; ++tick)
    label(kLeft + kColumns * kCell * tick / 3, kTop + kRows * kCell + 16, std::to_string(tick),
          "middle");
  label(kLeft + kColumns * kCell / 2, height - 12, "overload (fraction of the base cost)",
        "middle");
  label(kLeft, 18, "buffer (entries); darker: longer until late", "start");
  return svg + "</svg>";
}

std::string captioned(const std::string& svg, const std::string& caption) {
  return "<figure>" + svg + "<figcaption>" + caption + "</figcaption></figure>";
}

}  // namespace

std::string anticipation_html(const AnticipationHead& head,
                              const std::vector<AnticipationPoint>& points) {
  return html_page(
      "What anticipation buys: " + head.scene, {head.command, machine_name()},
      captioned(svg_plot(figure(head, points)),
                "How long a full transform buffer hides an overload from the renderer. The law: "
                "A = F r / (r - 1) steps for F entries in store and steps of r frames each.") +
          captioned(surface(),
                    "The law over buffers of 1 to 1024 entries, base load 1. Point at a cell for "
                    "its steps.") +
          "<h2>All points</h2><pre>" + escaped_xml(anticipation_text(head, points)) + "</pre>");
}

std::string buffer_costs_html(const AnticipationHead& head, const std::vector<BufferCost>& costs) {
  Plot plot;
  plot.title = "Makespan over the size of buffers";
  plot.x_label = "buffer (entries)";
  plot.y_label = "makespan (ms)";
  PlotSeries series{"makespan", true, {}};
  for (const BufferCost& cost : costs) {
    series.points.emplace_back(static_cast<double>(cost.buffer), 1e3 * cost.makespan_s);
    plot.x_max = std::max(plot.x_max, 1.05 * static_cast<double>(cost.buffer));
    plot.y_max = std::max(plot.y_max, 1.1e3 * cost.makespan_s);
  }
  std::ranges::sort(series.points);
  plot.series.push_back(std::move(series));
  return html_page("What buffers buy without a clock: " + head.scene,
                   {head.command, machine_name()},
                   captioned(svg_plot(plot), "On the virtual cluster; the knee is at " +
                                                 std::to_string(knee_of(costs)) + " entries.") +
                       "<pre>" + escaped_xml(buffer_costs_text(costs)) + "</pre>");
}

}  // namespace soda::analysis
