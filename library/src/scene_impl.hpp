// Behind Scene, and from the library's values to those of the layers below and back.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "models/user_input/scene_versions.hpp"
#include "physics/model/body_state.hpp"
#include "physics/shapes/geometry.hpp"
#include "scenarios/read_scenario.hpp"
#include "soda/inputs.hpp"
#include "soda/scene.hpp"

namespace soda {

// Shared between threads: constant but for the versions, which lock.
struct Scene::Impl {
  explicit Impl(scenarios::Scenario read);

  const scenarios::Scenario scenario;
  const physics::Geometry geometry;
  // Of what is simulated: who has another one has no use for this one's snapshots.
  const std::uint64_t fingerprint;
  // A memory that changes no result; see SceneVersions.
  mutable models::SceneVersions versions;
};

inline physics::Vec3 inner(const Vec3& v) { return {v.x, v.y, v.z}; }
inline physics::Quat inner(const Quat& q) { return {q.w, q.x, q.y, q.z}; }
inline Vec3 outer(const physics::Vec3& v) { return {v.x(), v.y(), v.z()}; }
inline Quat outer(const physics::Quat& q) { return {q.w(), q.x(), q.y(), q.z()}; }
inline BodyState outer(const physics::BodyState& state) {
  return {outer(state.position_m), outer(state.orientation), outer(state.linear_velocity_m_s),
          outer(state.angular_velocity_rad_s)};
}
// Bodies are known by their labels outside.
Solid outer(const physics::SceneDescription& scene, physics::BodyId id);
// Throws UsageError if no body has this id.
physics::BodyId body_with(const physics::SceneDescription& scene, std::uint32_t label);

SceneError scene_error(const scenarios::InputError& error);
// What the layers below throw, as what the library throws.
template <class Call>
auto translated(const Call& call) {
  try {
    return call();
  } catch (const scenarios::InputError& error) {
    throw scene_error(error);
  } catch (const scenarios::FileError& error) {
    throw FileError(error.what());
  }
}

// An input as a line of JSON.
std::string input_line(const scenarios::Scenario& scenario, const Input& input);
// Such a line, read by the rules of scenarios; its step is -1 if it gives no time. Throws
// SceneError.
models::UserInput read_input(const scenarios::Scenario& scenario, std::string_view line);

}  // namespace soda
