// Bodies and territories over time, to be looked at.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "analysis/event_log/log_reader.hpp"
#include "analysis/viewer/frame_marks.hpp"
#include "analysis/viewer/triangles.hpp"
#include "models/territory/territory.hpp"
#include "scenarios/scenario.hpp"

namespace soda::analysis {

struct Recording {
  struct Body {
    std::uint32_t label = 0, shape = 0;
  };
  struct Static {
    std::string name;
    std::uint32_t shape = 0;
    std::array<float, 7> pose{};  // x, y, z in m; w, x, y, z of the orientation
  };
  struct CellChange {
    std::uint32_t frame = 0;  // the first one after it
    std::uint32_t cell = 0;   // Grid::index_of_cell
    std::uint16_t from = 0, to = 0;
  };
  static constexpr std::size_t kNumbers = 8;         // a body and frame: its pose, its speed in m/s
  static constexpr std::uint16_t kAway = 0xffff;     // the owner of a body that is not there
  static constexpr std::uint16_t kResting = 0x8000;  // set in the owner of a body without velocity

  std::string name;
  double dt_s = 0.0;
  physics::Vec3 up = physics::Vec3::UnitZ();  // against gravity; unit length
  std::uint32_t worlds = 1;
  std::vector<Triangles> shapes;
  std::vector<Body> bodies;  // by BodyId
  std::vector<Static> statics;
  models::Grid grid;
  std::vector<std::uint16_t> cell_owners;  // in the first frame
  std::vector<CellChange> changes;         // in order
  std::vector<std::int64_t> steps;         // of each frame
  std::vector<float> numbers;              // by frame, then body
  std::vector<std::uint16_t> owners;
  FrameMarks marks;
};

// Of what is there at the beginning and at the end, with two cells around it.
struct Extent {
  physics::Vec3 middle_m;
  double reach_m;
};
Extent extent_of(LogReader& log, double cell_m);

// In the frame of a body of this shape; of a half space nothing. Less fine the more bodies there
// are: all corners of all of them are drawn.
Triangles seen(const physics::Shape& shape, const physics::SceneDescription& scene);
// In the static's frame; of a half space what lies within the extent.
Triangles seen_static(const physics::StaticBody& body, const physics::SceneDescription& scene,
                      const Extent& extent);

// Every `every`th step of the log and its last one. Territories are those of the step that led to
// a frame, whatever balancing has made of them by then. `every` >= 1. Throws FileError for a state
// that is no number.
Recording record(LogReader& log, const scenarios::Scenario& scenario, std::int64_t every);

}  // namespace soda::analysis
