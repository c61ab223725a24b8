// What a log tells of single bodies in a step, and which bodies may come near a place in it.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "analysis/event_log/single_states.hpp"
#include "models/user_input/user_input.hpp"
#include "physics/shapes/geometry.hpp"

namespace soda::analysis {

// Whether an input acts on the description of a scene, and not on the state of a body.
constexpr bool changes_scene(models::InputKind kind) {
  return kind == models::InputKind::kChangeMaterial || kind == models::InputKind::kSetMotor;
}

// A body in a step. What it may have touched lies in its box, whatever the others did.
struct RecordedBody {
  std::optional<physics::BodyState> start, end;  // when inputs have acted, and after the step
  physics::Aabb box;                             // void if it is not there
};

// Around all that a body has come to between two states.
physics::Aabb box_of_step(const physics::SceneDescription& scene, const physics::Geometry& geometry,
                          physics::BodyId id, const physics::BodyState& start,
                          const physics::BodyState* end);

class RecordedBodies {
 public:
  // A log of the scene with the states of each step. All three must outlive this object.
  RecordedBodies(LogReader& log, const physics::SceneDescription& scene,
                 const physics::Geometry& geometry);

  // The step from `step` on, in which the inputs acted. Whether the log has bounds of it.
  bool begin(std::int64_t step, std::span<const models::CommittedInput> inputs);
  // Of that step. Throws FileError for what no run can have recorded.
  const RecordedBody& body(physics::BodyId id);
  // The state when the step begins, before inputs act.
  std::optional<physics::BodyState> before(physics::BodyId id) { return read(id, step_); }

  // At most, of all bodies.
  double most_speed_m_s() const { return most_speed_m_s_; }
  // The bodies whose box may overlap this one in any step with the same bounds: those that this one
  // holds, and their last step. Bodies on which inputs act may be elsewhere.
  void find_near(const physics::Aabb& box, std::vector<physics::BodyId>& near) const;
  std::int64_t bounded_to() const { return bounded_to_; }

 private:
  // No body's box lies beyond; rounded outwards.
  struct Room {
    std::array<float, 3> low{}, high{};
  };

  std::optional<physics::BodyState> read(physics::BodyId id, std::int64_t step);
  bool read_bounds();
  double reach_m(physics::BodyId id, double spin_rad_s) const;

  LogReader& log_;
  const physics::SceneDescription& scene_;
  const physics::Geometry& geometry_;
  SingleStates states_;
  std::int64_t step_ = -1;
  std::vector<models::UserInput> inputs_;  // of the step, in the order of acting
  std::map<physics::BodyId, RecordedBody> bodies_;
  std::int64_t bounded_to_ = -1;  // the last step that is within the bounds
  double most_speed_m_s_ = 0.0;
  std::vector<Room> rooms_;
};

}  // namespace soda::analysis
