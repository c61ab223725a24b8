// Points, lines of numbers about them and triangles as a file of VTK: XML PolyData.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "physics/model/ids.hpp"

namespace soda::analysis {

// Numbers are base64 of their bytes, the lowest first.
class VtkPolyData {
 public:
  VtkPolyData(std::int64_t step, double time_s) : step_(step), time_s_(time_s) {}

  // Where points are, and then, if each is a corner of triangles, three of them for each.
  void set_points(std::span<const double> xyz_m);
  void set_points(std::span<const float> xyz_m, std::span<const std::int32_t> corners);

  // `components` numbers for each point; with triangles for each of these. Names in XML as they
  // are.
  void add(const std::string& name, std::span<const double> numbers, int components = 1);
  void add(const std::string& name, std::span<const float> numbers, int components = 1);
  void add(const std::string& name, std::span<const std::int64_t> numbers, int components = 1);

  std::string text() const;

 private:
  const std::int64_t step_;
  const double time_s_;
  std::size_t points_ = 0, triangles_ = 0;
  std::string places_, cells_, arrays_;
};

// A collection: files by time.
struct VtkFrame {
  double time_s = 0.0;
  std::string file;
};
std::string vtk_collection(std::span<const VtkFrame> frames);

}  // namespace soda::analysis
