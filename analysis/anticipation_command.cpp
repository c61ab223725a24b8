#include "analysis/anticipation_command.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <ostream>

#include "analysis/exit_codes.hpp"
#include "analysis/json_output.hpp"
#include "analysis/output_file.hpp"
#include "analysis/svg_plot.hpp"
#include "analysis/text_table.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::analysis {
namespace {

constexpr double kPaperFrameS = 1.0 / 60.0;

void check(const AnticipationOptions& options) {
  for (const std::int64_t buffer : options.buffers) {
    if (buffer < 1 || buffer > 1'000'000) {
      throw UsageError("--buffers: found " + std::to_string(buffer) + "; allowed: 1 to 1000000");
    }
  }
  for (const double overload : options.overloads) {
    if (!(overload >= 0.0 && overload <= 100.0)) {
      throw UsageError("--overloads: found " + format_number(overload) +
                       "; allowed: 0 to 100 (1 is twice the cost)");
    }
  }
  if (!(options.utilisation > 0.0 && options.utilisation <= 10.0)) {
    throw UsageError("--utilisation: found " + format_number(options.utilisation) +
                     "; allowed: above 0, up to 10");
  }
  if (options.max_steps < 1) throw UsageError("--max-steps: allowed: at least 1");
}

std::string steps_text(double steps) {
  if (std::isnan(steps)) return "-";
  return std::isfinite(steps) ? format_number(std::round(steps), 7) : "never";
}

std::string measured_text(double value, int digits, const char* unit) {
  return std::isnan(value) ? "-" : format_number(value, digits) + unit;
}

std::string late_text(const AnticipationPoint& point, std::int64_t max_steps) {
  if (std::isnan(point.ratio)) return "in the warm-up";
  return point.late ? std::to_string(point.steps_until_late) : "> " + std::to_string(max_steps);
}

std::string report_text(const AnticipationReport& report, const AnticipationOptions& options) {
  std::vector<std::vector<std::string>> rows;
  for (const AnticipationPoint& point : report.points) {
    const double wanted_ratio = options.utilisation * (1.0 + point.overload);
    rows.push_back(
        {std::to_string(point.buffer), format_number(100 * point.overload) + " %",
         std::to_string(point.bodies), measured_text(100 * point.measured_overload, 3, " %"),
         measured_text(point.ratio, 4, ""), std::to_string(point.filled),
         late_text(point, options.max_steps), steps_text(point.closed_form_steps),
         steps_text(anticipation_steps(static_cast<double>(point.buffer), wanted_ratio))});
  }
  const auto right = [](const char* title) { return Column{title, Align::kRight}; };
  return std::to_string(report.base_bodies) +
         " coincident cubes: " + format_number(1e3 * report.base_step_s) +
         " ms of CPU time a step\nframe time " + format_number(1e3 * report.frame_s) +
         " ms, so that the utilisation is " + format_number(report.utilisation) +
         " (60 FPS on a machine " + format_number(kPaperFrameS / report.frame_s, 3) +
         " times slower)\n\n" +
         format_table({right("buffer"), right("overload"), right("cubes"), right("measured"),
                       right("r"), right("filled"), right("steps until late"),
                       right("A(filled, r)"), right("A(buffer, wanted)")},
                      rows);
}

// One series of measured points and one of the law for every buffer.
Plot figure(const AnticipationReport& report, const AnticipationOptions& options) {
  Plot plot;
  plot.title = "Steps until late after an overload: measured (dots), law (lines)";
  plot.x_label = "additional cost (fraction of the base cost)";
  plot.y_label = "steps until late";
  plot.x_max = 0.1;
  plot.y_max = 10.0;
  for (const AnticipationPoint& point : report.points) {
    plot.x_max = std::max(plot.x_max, 1.1 * point.measured_overload);
    if (point.late) {
      plot.y_max = std::max(plot.y_max, 1.1 * static_cast<double>(point.steps_until_late));
    }
  }
  for (const std::int64_t buffer : options.buffers) {
    PlotSeries law{"B = " + std::to_string(buffer), true, {}};
    for (int i = 1; i <= 200; ++i) {
      const double overload = plot.x_max * i / 200;
      const double steps =
          anticipation_steps(static_cast<double>(buffer), report.utilisation * (1.0 + overload));
      if (std::isfinite(steps)) law.points.emplace_back(overload, steps);
    }
    PlotSeries measured{law.name, false, {}};
    for (const AnticipationPoint& point : report.points) {
      if (point.buffer != buffer || !point.late || !(point.measured_overload >= 0.0)) continue;
      measured.points.emplace_back(point.measured_overload,
                                   static_cast<double>(point.steps_until_late));
    }
    plot.series.push_back(std::move(law));
    plot.series.push_back(std::move(measured));
  }
  return plot;
}

}  // namespace

int anticipation_command(const AnticipationRequest& request, std::ostream& out) {
  check(request.options);
  std::optional<OutputFile> svg;
  if (!request.svg_file.empty()) svg.emplace(request.svg_file, request.force);
  const AnticipationReport report = measure_anticipation(request.options);
  if (svg) {
    svg->write(svg_plot(figure(report, request.options)));
    svg->complete();
  }
  out << (request.json ? anticipation_json(report) : report_text(report, request.options));
  return kExitOk;
}

}  // namespace soda::analysis
