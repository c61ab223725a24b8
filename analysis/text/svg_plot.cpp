#include "analysis/text/svg_plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "analysis/text/text_table.hpp"

namespace soda::analysis {
namespace {

constexpr double kWidth = 720, kHeight = 440, kLeft = 70, kRight = 130, kTop = 40, kBottom = 60;

double place_x(const Plot& plot, double x) {
  return kLeft + x / plot.x_max * (kWidth - kLeft - kRight);
}
double place_y(const Plot& plot, double y) {
  return kHeight - kBottom - y / plot.y_max * (kHeight - kTop - kBottom);
}

std::string text_at(double x, double y, const char* anchor, const std::string& text) {
  return "<text x=\"" + format_number(x) + "\" y=\"" + format_number(y) + "\" text-anchor=\"" +
         anchor + "\">" + escaped_xml(text) + "</text>\n";
}

std::string segment(double x1, double y1, double x2, double y2, const char* colour) {
  return "<line x1=\"" + format_number(x1) + "\" y1=\"" + format_number(y1) + "\" x2=\"" +
         format_number(x2) + "\" y2=\"" + format_number(y2) + "\" stroke=\"" + colour + "\"/>\n";
}

// 1, 2 or 5 times a power of ten, about a fifth of the axis.
double tick_step(double max) {
  const double power = std::pow(10.0, std::floor(std::log10(max / 5)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power * 5 >= max * 0.999) return factor * power;
  }
  return 10 * power;
}

std::string axes(const Plot& plot) {
  std::string out;
  for (int i = 0; i * tick_step(plot.x_max) <= plot.x_max * 1.001; ++i) {
    const double x = place_x(plot, i * tick_step(plot.x_max));
    out += segment(x, kTop, x, kHeight - kBottom, "#dddddd");
    out += text_at(x, kHeight - kBottom + 18, "middle", format_number(i * tick_step(plot.x_max)));
  }
  for (int i = 0; i * tick_step(plot.y_max) <= plot.y_max * 1.001; ++i) {
    const double y = place_y(plot, i * tick_step(plot.y_max));
    out += segment(kLeft, y, kWidth - kRight, y, "#dddddd");
    out += text_at(kLeft - 6, y + 4, "end", format_number(i * tick_step(plot.y_max)));
  }
  out += text_at((kLeft + kWidth - kRight) / 2, kHeight - 16, "middle", plot.x_label);
  out += text_at(kLeft - 50, kTop - 12, "start", plot.y_label);
  out += text_at(kWidth / 2, 18, "middle", plot.title);
  return out;
}

std::string drawn(const Plot& plot, const PlotSeries& series, const char* colour) {
  std::string line, markers;
  for (const auto& [x, y] : series.points) {
    if (x > plot.x_max || y > plot.y_max) continue;
    const std::string px = format_number(place_x(plot, x)), py = format_number(place_y(plot, y));
    line += px + ",";
    line += py + " ";
    markers += "<circle cx=\"" + px;
    markers += "\" cy=\"" + py + "\" r=\"4\" fill=\"" + colour + "\"/>\n";
  }
  if (!series.line) return markers;
  return "<polyline fill=\"none\" stroke=\"" + std::string(colour) + "\" points=\"" + line +
         "\"/>\n";
}

}  // namespace

std::string escaped_xml(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '<')
      out += "&lt;";
    else if (c == '&')
      out += "&amp;";
    else if (c == '"')
      out += "&quot;";
    else
      out += c;
  }
  return out;
}

std::string svg_plot(const Plot& plot) {
  std::string out = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + format_number(kWidth) +
                    "\" height=\"" + format_number(kHeight) + "\" viewBox=\"0 0 " +
                    format_number(kWidth) + " " + format_number(kHeight) +
                    "\" font-family=\"sans-serif\" font-size=\"12\">\n"
                    "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n" +
                    axes(plot);
  std::vector<std::string> names;
  for (const PlotSeries& series : plot.series) {
    auto found = std::find(names.begin(), names.end(), series.name);
    const auto index = static_cast<std::size_t>(found - names.begin());
    const char* colour = kSeriesColours[index % kSeriesColours.size()];
    if (found == names.end()) {
      names.push_back(series.name);
      const double y = kTop + 12 + 20 * static_cast<double>(index);
      out += segment(kWidth - kRight + 12, y, kWidth - kRight + 32, y, colour);
      out += text_at(kWidth - kRight + 38, y + 4, "start", series.name);
    }
    out += drawn(plot, series, colour);
  }
  return out + "</svg>\n";
}

}  // namespace soda::analysis
