// A line plot as SVG, self-contained.
#pragma once

#include <array>
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

// Of series, in turn. Okabe and Ito's: distinguishable with any colour vision.
inline constexpr std::array<const char*, 6> kSeriesColours{"#0072b2", "#d55e00", "#009e73",
                                                           "#cc79a7", "#e69f00", "#56b4e9"};

std::string svg_plot(const Plot& plot);

// Text for XML and HTML, between tags or in quoted attributes.
std::string escaped_xml(const std::string& text);

}  // namespace soda::analysis
