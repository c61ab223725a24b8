// What `soda anticipation` found: as text, JSON, CSV, and one HTML page.
#pragma once

#include <string>
#include <vector>

#include "analysis/anticipation/anticipation_run.hpp"

namespace soda::analysis {

// What a report says of its run beside the points.
struct AnticipationHead {
  std::string scene;  // name
  std::uint32_t worlds = 1;
  std::string workers;  // "2 threads", "3 processors"
  AnticipationOptions options;
  std::string peak;     // as it was given
  std::string command;  // as it was typed
};

std::string anticipation_text(const AnticipationHead& head,
                              const std::vector<AnticipationPoint>& points);
std::string anticipation_json(const AnticipationHead& head,
                              const std::vector<AnticipationPoint>& points);
std::string anticipation_csv(const std::vector<AnticipationPoint>& points);
// With the law as lines, runs as dots, and the law over all buffers of 1 to 1024 as a picture.
std::string anticipation_html(const AnticipationHead& head,
                              const std::vector<AnticipationPoint>& points);

std::string buffer_costs_text(const std::vector<BufferCost>& costs);
std::string buffer_costs_json(const std::string& scene, const std::vector<BufferCost>& costs);
std::string buffer_costs_csv(const std::vector<BufferCost>& costs);
std::string buffer_costs_html(const AnticipationHead& head, const std::vector<BufferCost>& costs);

}  // namespace soda::analysis
