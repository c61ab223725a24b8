// Error against run time, or what else is positive, both logarithmic, as SVG.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace soda::analysis {

struct WorkPrecisionPoint {
  double cpu_s = 0.0;  // per simulated second, or what the x axis shows; > 0
  double error = 0.0;  // >= 0; what is not finite is drawn at the upper edge
  std::string label;   // of the setting, shown beside the point; may be empty
};
struct WorkPrecisionSeries {
  std::string name;
  std::vector<WorkPrecisionPoint> points;
  bool joined = true;  // in this order
};
struct WorkPrecisionPlot {
  std::string title, y_label;
  std::string x_label = "CPU time per simulated second, s/s";
  std::string x_unit = "s/s";           // behind the number of a point
  std::optional<double> must, stretch;  // drawn as lines
  const char *must_name = "must", *stretch_name = "stretch";
  std::vector<WorkPrecisionSeries> series;
};

// Self-contained, about 560 x 380; both axes reach from power of ten to power of ten.
std::string work_precision_svg(const WorkPrecisionPlot& plot);

}  // namespace soda::analysis
