// rollback_share [-o FILE.svg]: what a rollback costs over how much of a world is dirty. A hundred
// balls rest in one territory, far apart. From another territory, where nothing else is, fast ones
// come in and each hits one; they are seen late. Counts solves on the virtual cluster, so the
// figures are the same on every machine.
#include <cstring>
#include <fstream>
#include <iostream>
#include <sstream>
#include <string>

#include "analysis/text/svg_plot.hpp"
#include "analysis/text/text_table.hpp"
#include "models/run/simulation.hpp"
#include "scenarios/read_scenario.hpp"

namespace {

using namespace soda;

constexpr int kRows = 100;
constexpr int kMiddleRow = kRows / 2;

std::string scene_text(int intruders) {
  std::ostringstream text;
  text << R"({"format": 1, "gravity_m_s2": [0, 0, -9.81], "time_step_s": 0.016666666666666666,
    "steps": 60, "materials": [{"name": "m", "friction": 0.5, "restitution": 0}],
    "statics": [{"name": "ground", "shape": {"type": "halfspace"}, "material": "m"}],
    "territory": {"origin_m": [-64, -64, 0], "cell_size_m": 1, "cells": [128, 128, 2],
                  "worlds": 2, "map": "blocks"}, "buffer_entries": 48, "bodies": [)";
  const auto ball = [&text](int id, double x, double y, double speed) {
    text << (id == 0 ? "" : ",") << R"({"id": )" << id
         << R"(, "shape": {"type": "sphere", "radius_m": 0.25}, "density_kg_m3": 1000,)"
         << R"("material": "m", "position_m": [)" << x << ", " << y << R"(, 0.25],)"
         << R"("velocity_m_s": [)" << speed << ", 0, 0]}";
  };
  const auto row = [](int i) { return 1.2 * (i - kMiddleRow) + 0.6; };
  for (int i = 0; i < kRows; ++i) ball(i, 2.0, row(i), 0.0);
  for (int i = 0; i < intruders; ++i) ball(kRows + i, -2.0, row(i), 24.0);
  text << "]}";
  return text.str();
}

std::uint64_t wasted_solves(const scenarios::Scenario& scenario, models::RollbackMode rollback) {
  models::RunOptions options = scenario.run;
  options.executor = models::ExecutorKind::kVirtual;
  options.rollback = rollback;
  options.cluster = {.processors = 2, .latency_ns = 2'000'000};
  const models::SimulationResult result = models::simulate(
      scenario.scene, scenario.initial,
      models::make_territory_map(scenario.territory, {}, &scenario.scene), options);
  return result.stages.islands_advanced() - result.islands_committed;
}

int run(const char* svg_file) {
  analysis::PlotSeries propagate{"propagate", true, {}}, invalidate{"invalidate", true, {}};
  std::vector<std::vector<std::string>> rows;
  for (const int intruders : {0, 1, 2, 5, 10, 20, 40, 60, 80, 100}) {
    const scenarios::Scenario scenario =
        scenarios::read_scenario_text(scene_text(intruders), "rollback_share", {});
    const std::uint64_t some = wasted_solves(scenario, models::RollbackMode::kPropagate);
    const std::uint64_t all = wasted_solves(scenario, models::RollbackMode::kInvalidate);
    propagate.points.emplace_back(intruders, static_cast<double>(some));
    invalidate.points.emplace_back(intruders, static_cast<double>(all));
    rows.push_back({std::to_string(intruders), std::to_string(some), std::to_string(all)});
  }
  std::cout << analysis::format_table({{"rows hit, of 100", analysis::Align::kRight},
                                       {"propagate wastes", analysis::Align::kRight},
                                       {"invalidate wastes", analysis::Align::kRight}},
                                      rows);
  if (svg_file == nullptr) return 0;
  analysis::Plot plot{"Solves wasted by rollbacks over how much is dirty",
                      "rows hit, of 100",
                      "solves wasted",
                      100.0,
                      1.0,
                      {propagate, invalidate}};
  for (const analysis::PlotSeries& series : plot.series)
    for (const auto& [x, y] : series.points) plot.y_max = std::max(plot.y_max, 1.1 * y);
  std::ofstream svg(svg_file, std::ios::trunc);
  svg << analysis::svg_plot(plot);
  svg.close();
  if (svg) return 0;
  std::cerr << "rollback_share: " << svg_file << " cannot be written\n";
  return 3;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 1 && (argc != 3 || std::strcmp(argv[1], "-o") != 0)) {
    std::cerr << "usage: rollback_share [-o FILE.svg]\n";
    return 2;
  }
  try {
    return run(argc == 3 ? argv[2] : nullptr);
  } catch (const std::exception& error) {
    std::cerr << "rollback_share: " << error.what() << "\n";
    return 2;
  }
}
