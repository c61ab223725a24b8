// What lies between bodies, to be drawn: contacts, ghosts and joints of a run's frames.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "analysis/event_log/log_format.hpp"
#include "models/territory/territory.hpp"
#include "physics/model/scene.hpp"
#include "physics/shapes/geometry.hpp"

namespace soda::analysis {

struct FrameMarks {
  struct Contact {
    std::uint32_t a = 0, b = 0;                      // ids; b may be a static
    std::array<float, 3> point_m{}, force_newton{};  // on b
    float normal_newton = 0.0f, depth_m = 0.0f;
  };
  // A world that has a body as a ghost.
  struct Ghost {
    std::uint32_t body = 0;
    std::uint16_t world = 0;
  };
  // A frame whose contacts and ghosts are known.
  struct Frame {
    std::uint32_t frame = 0;
    std::vector<Contact> contacts;  // those that bear something
    std::vector<Ghost> ghosts;
  };
  struct Joint {
    std::uint32_t a = 0, b = 0;  // ids; b may be kWorldBody
    std::uint8_t kind = 0;       // physics::JointKind
    std::array<float, 3> anchor_a_m{}, anchor_b_m{};
    std::uint32_t label = 0;
    std::uint32_t broken_from = 0xffff'ffffu;  // the first frame
  };
  struct Energy {
    float kinetic_joule = 0.0f, potential_joule = 0.0f;
  };

  std::uint32_t every = 1;  // frames from one of `frames` to the next
  std::vector<Frame> frames;
  std::vector<Joint> joints;
  std::vector<Energy> energies;     // of all frames
  bool has_strongest_only = false;  // some frame has more contacts than a page holds
};

// Takes frames in their order. Contacts are searched in some of them, fewer as they take more
// bytes: at most 6 MB, but for two frames.
class FrameMarker {
 public:
  // `scene` outlives the object; `frames`: how many there will be.
  FrameMarker(const physics::SceneDescription& scene, std::size_t frames);

  // The territories are those that the step began with.
  void add(const LoggedStep& logged, const models::TerritoryMap& map);
  FrameMarks finish() { return std::move(marks_); }

 private:
  FrameMarks::Frame marked(const LoggedStep& logged, const models::TerritoryMap& map);
  void add_broken(const LoggedStep& logged);
  void thin_out();

  const physics::SceneDescription& scene_;
  const physics::Geometry geometry_;
  std::uint32_t next_ = 0;
  std::size_t bytes_ = 0;
  std::size_t unbroken_ = 0;  // joints that can break and have not
  FrameMarks marks_;
};

}  // namespace soda::analysis
