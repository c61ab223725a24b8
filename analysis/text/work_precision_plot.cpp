#include "analysis/text/work_precision_plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "analysis/text/svg_plot.hpp"
#include "analysis/text/text_table.hpp"

namespace soda::analysis {
namespace {

constexpr double kSheetWidth = 600, kSheetHeight = 380, kSheetLeft = 72, kSheetRight = 136,
                 kSheetTop = 34, kSheetBottom = 48;
constexpr double kSmallest = 1e-17;  // errors below are drawn here: rounding, or none at all

// A logarithmic axis between whole powers of ten.
struct Axis {
  int low = 0, high = 1;
  double from = 0.0, to = 1.0;  // where its ends are drawn

  double place(double value) const {
    const double power = std::clamp(std::log10(value), double(low), double(high));
    return from + (power - low) / (high - low) * (to - from);
  }
};

Axis axis_over(const std::vector<double>& values, double from, double to) {
  double least = 1e300, most = 0.0;
  for (const double value : values) {
    if (!std::isfinite(value) || value <= 0.0) continue;
    least = std::min(least, value);
    most = std::max(most, value);
  }
  if (most == 0.0) least = most = 1.0;
  Axis axis{static_cast<int>(std::floor(std::log10(least))),
            static_cast<int>(std::ceil(std::log10(most))), from, to};
  if (axis.high == axis.low) ++axis.high;
  return axis;
}

std::string digits(double value) { return format_number(value, 5); }

std::string sheet_text(double x, double y, const char* anchor, const std::string& text,
                       const char* extra = "") {
  return "<text x=\"" + digits(x) + "\" y=\"" + digits(y) + "\" text-anchor=\"" + anchor + "\"" +
         extra + ">" + escaped_xml(text) + "</text>\n";
}

std::string line(double x1, double y1, double x2, double y2, const std::string& stroke) {
  return "<line x1=\"" + digits(x1) + "\" y1=\"" + digits(y1) + "\" x2=\"" + digits(x2) +
         "\" y2=\"" + digits(y2) + "\" " + stroke + "/>\n";
}

std::string power_text(int power) { return "1e" + std::to_string(power); }

std::string grid(const Axis& x, const Axis& y, const WorkPrecisionPlot& plot) {
  std::string out;
  const std::string grey = "stroke=\"#dddddd\"";
  for (int power = x.low; power <= x.high; ++power) {
    const double at = x.place(std::pow(10.0, power));
    out += line(at, y.to, at, y.from, grey);
    out += sheet_text(at, y.from + 16, "middle", power_text(power));
  }
  const int every = 1 + (y.high - y.low) / 9;
  for (int power = y.low; power <= y.high; power += every) {
    const double at = y.place(std::pow(10.0, power));
    out += line(x.from, at, x.to, at, grey);
    out += sheet_text(x.from - 6, at + 4, "end", power_text(power));
  }
  out += sheet_text((x.from + x.to) / 2, kSheetHeight - 12, "middle", plot.x_label);
  out += sheet_text(8, kSheetTop - 14, "start", plot.y_label, " font-weight=\"bold\"");
  return out;
}

std::string bound_line(const Axis& x, const Axis& y, const std::optional<double>& bound,
                       const char* name, const char* dashes) {
  if (!bound || !(*bound > 0.0)) return {};
  const double at = y.place(*bound);
  return line(x.from, at, x.to, at,
              std::string("stroke=\"#444444\" stroke-dasharray=\"") + dashes + "\"") +
         sheet_text(x.from + 5, at - 4, "start", name, " fill=\"#444444\"");
}

std::string drawn(const WorkPrecisionSeries& series, const Axis& x, const Axis& y,
                  const std::string& colour, const char* dashes, const std::string& x_unit) {
  std::string path, marks;
  for (const WorkPrecisionPoint& point : series.points) {
    const bool finite = std::isfinite(point.error);
    const double px = x.place(point.cpu_s);
    const double py = finite ? y.place(std::max(point.error, kSmallest)) : y.to;
    path += digits(px) + "," + digits(py) + " ";
    marks += "<circle cx=\"" + digits(px) + "\" cy=\"" + digits(py) + "\" r=\"3.5\" fill=\"" +
             (finite ? colour : "white") + "\" fill-opacity=\"" + (series.joined ? "1" : ".6") +
             "\" stroke=\"" + colour + "\"><title>" +
             escaped_xml(series.name + " " + point.label + ": error " +
                         (finite ? digits(point.error) : "is no number") + ", " +
                         digits(point.cpu_s) + " " + x_unit) +
             "</title></circle>\n";
  }
  if (!series.joined) return marks;
  return "<polyline fill=\"none\" stroke=\"" + colour + "\"" + dashes +
         " stroke-width=\"1.3\" points=\"" + path + "\"/>\n" + marks;
}

}  // namespace

std::string work_precision_svg(const WorkPrecisionPlot& plot) {
  std::vector<double> times, errors;
  for (const WorkPrecisionSeries& series : plot.series)
    for (const WorkPrecisionPoint& point : series.points) {
      times.push_back(point.cpu_s);
      errors.push_back(std::max(point.error, kSmallest));
    }
  for (const std::optional<double>& bound : {plot.must, plot.stretch})
    if (bound) errors.push_back(*bound);
  const Axis x = axis_over(times, kSheetLeft, kSheetWidth - kSheetRight);
  const Axis y = axis_over(errors, kSheetHeight - kSheetBottom, kSheetTop);
  std::string out = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + digits(kSheetWidth) +
                    "\" height=\"" + digits(kSheetHeight) + "\" viewBox=\"0 0 " +
                    digits(kSheetWidth) + " " + digits(kSheetHeight) +
                    "\" font-family=\"sans-serif\" font-size=\"11\">\n"
                    "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n" +
                    grid(x, y, plot) + bound_line(x, y, plot.must, plot.must_name, "6 3") +
                    bound_line(x, y, plot.stretch, plot.stretch_name, "2 3");
  out += sheet_text((x.from + x.to) / 2, kSheetTop - 14, "middle", plot.title);
  double legend = kSheetHeight - kSheetBottom - 18.0 * static_cast<double>(plot.series.size()) + 14;
  for (std::size_t i = 0; i < plot.series.size(); ++i, legend += 18) {
    const char* colour = kSeriesColours[i % kSeriesColours.size()];
    // More series than colours: dashed.
    const char* dashes = i < kSeriesColours.size() ? "" : " stroke-dasharray=\"5 3\"";
    out += drawn(plot.series[i], x, y, colour, dashes, plot.x_unit);
    out += line(x.to + 8, legend - 4, x.to + 24, legend - 4,
                std::string("stroke-width=\"2\" stroke=\"") + colour + "\"" + dashes);
    out += sheet_text(x.to + 28, legend, "start", plot.series[i].name);
  }
  return out + "</svg>\n";
}

}  // namespace soda::analysis
