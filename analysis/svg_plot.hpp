// A line plot as SVG, self-contained.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace soda::analysis {

struct PlotSeries {
  std::string name;
  bool line = true;                               // false: markers only
  std::vector<std::pair<double, double>> points;  // finite, ascending in x
};

struct Plot {
  std::string title, x_label, y_label;
  double x_max = 1.0, y_max = 1.0;  // axes start at 0; > 0. Points beyond are left out.
  std::vector<PlotSeries> series;   // series with the same name share a colour
};

std::string svg_plot(const Plot& plot);

// Text for XML and HTML, between tags or in quoted attributes.
std::string escaped_xml(const std::string& text);

}  // namespace soda::analysis
