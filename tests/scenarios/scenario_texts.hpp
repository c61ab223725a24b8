// Scenario texts to break, and places in them.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "scenarios/read_scenario.hpp"

namespace soda::scenarios {

// A small scenario that uses every section.
inline constexpr std::string_view kSmallScenario = R"({
  "format": 1,
  "gravity_m_s2": [0, 0, -9.81],
  "time_step_s": 0.01,
  "duration_s": 1,
  "solver": {"iterations": 10, "broadphase": "grid", "warm_starting": true},
  "materials": [{"name": "wood", "friction": 0.5, "restitution": 0.25}],
  "bodies": [
    {"id": 7, "shape": {"type": "box", "size_m": [1, 2, 3]}, "mass_kg": 2,
     "material": "wood", "position_m": [0, 0, 5]},
    {"id": 2, "shape": {"type": "sphere", "radius_m": 0.5}, "density_kg_m3": 500,
     "material": "wood", "position_m": [3, 0, 5],
     "orientation": {"w": 1, "x": 0, "y": 0, "z": 0}, "velocity_m_s": [1, 2, 3]},
    {"id": 3, "shape": {"type": "hull",
                        "points_m": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]},
     "mass_kg": 1, "material": "wood", "position_m": [6, 0, 5],
     "orientation": {"axis": [0, 0, 2], "angle_deg": 90}, "drive": "walk"}
  ],
  "statics": [
    {"name": "floor", "shape": {"type": "halfspace", "normal": [0, 0, 3]}, "material": "wood"},
    {"name": "ramp", "material": "wood", "position_m": [0, 9, 0],
     "shape": {"type": "mesh", "vertices_m": [[0, 0, 0], [1, 0, 0], [0, 1, 0]],
               "triangles": [[0, 1, 2]]},
     "orientation": {"axis": [1, 0, 0], "angle_deg": 90}, "surface_velocity_m_s": [0, 4, 0]}
  ],
  "generators": [
    {"type": "stack", "first_id": 10, "shape": {"type": "sphere", "radius_m": 0.5},
     "mass_kg": 1, "material": "wood", "count": 3, "position_m": [9, 0, 1]},
    {"type": "gas", "first_id": 20, "shape": {"type": "sphere", "radius_m": 0.5},
     "mass_kg": 1, "material": "wood", "count": 5, "seed": 1, "max_speed_m_s": 2,
     "region_min_m": [20, 0, 1], "region_max_m": [30, 9, 9]}
  ],
  "drives": [
    {"name": "walk", "velocity_m_s": [0, 3, 0], "time_constant_s": 0.5,
     "max_acceleration_m_s2": 5},
    {"name": "lane", "way_points_m": [[0, 0, 0], [8, 0, 0], [8, 8, 0]], "speed_m_s": 1.5,
     "half_width_m": 1.25, "time_constant_s": 0.25, "max_acceleration_m_s2": 4}
  ],
  "territory": {"origin_m": [-8, -8, -8], "cell_size_m": 2, "cells": [8, 8, 8], "worlds": 2},
  "buffer_entries": 16,
  "executor": {"kind": "threads", "threads": 2},
  "balancing": {"policy": "paper", "interval_steps": 20},
  "output": {"log": "small.sodalog", "step_digests": true}
})";

// `text` with the only occurrence of `from` replaced.
inline std::string replaced(std::string_view text, std::string_view from, std::string_view to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, text.npos) << "nothing to replace: " << from;
  EXPECT_EQ(text.find(from, at + 1), text.npos) << "not unique: " << from;
  std::string result(text);
  if (at != text.npos) result.replace(at, from.size(), to);
  return result;
}

// The faults of a text; none if it is read.
inline std::vector<InputFault> faults_of(std::string_view text,
                                         const std::string& file = "test.json") {
  try {
    read_scenario_text(text, file);
  } catch (const InputError& error) {
    return error.faults();
  }
  return {};
}

inline std::string file_bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

inline std::filesystem::path library_folder() {
  return std::filesystem::path(SODA_SOURCE_DIR) / "scenarios" / "library";
}

// Every scenario of the library, by name.
inline std::vector<std::filesystem::path> library_files() {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(library_folder())) {
    if (entry.path().extension() == ".json") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

// The small cases with known answers, by name.
inline std::vector<std::filesystem::path> case_files() {
  std::vector<std::filesystem::path> files;
  for (const auto& entry :
       std::filesystem::directory_iterator(library_folder().parent_path() / "cases")) {
    if (entry.path().extension() == ".json" && entry.file_size() < 4000)
      files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace soda::scenarios
