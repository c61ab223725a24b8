// A scene: loaded from a scenario file, or built.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "soda/errors.hpp"
#include "soda/export.hpp"
#include "soda/values.hpp"

namespace soda {

// Shapes. Their frame is that of the body or static that has them, its origin where the body is
// put.
struct Sphere {
  double radius_m = 0.5;
};
struct Box {
  Vec3 size_m{1.0, 1.0, 1.0};
};
struct Capsule {  // around z; the length is that of its cylinder
  double radius_m = 0.5, length_m = 1.0;
};
struct Cylinder {  // around z
  double radius_m = 0.5, length_m = 1.0;
};
struct Hull {
  std::vector<Vec3> points_m = {};
};
using ConvexShape = std::variant<Sphere, Box, Capsule, Cylinder, Hull>;
struct Part {
  ConvexShape shape = {};
  Vec3 position_m = {};
  Quat orientation = {};
};
struct Compound {
  std::vector<Part> parts = {};
};
struct Mesh {  // static only; counter-clockwise seen from outside
  std::vector<Vec3> vertices_m = {};
  std::vector<std::array<std::uint32_t, 3>> triangles = {};
};
struct HalfSpace {  // static only; solid where normal . x <= offset
  Vec3 normal{0.0, 0.0, 1.0};
  double offset_m = 0.0;
};
using Shape = std::variant<Sphere, Box, Capsule, Cylinder, Hull, Compound, Mesh, HalfSpace>;

struct Material {
  std::string name = {};
  double friction = 0.5, restitution = 0.0;
  double rolling_friction_m = 0.0, torsional_friction_m = 0.0;
};

struct Body {
  std::uint32_t id = 0;  // unique; up to 2^31 - 1
  Shape shape = {};
  std::string material = {};
  std::optional<double> mass_kg = {}, density_kg_m3 = {};  // one of them, unless it is kinematic
  Vec3 position_m = {};
  Quat orientation = {};
  Vec3 velocity_m_s = {};
  Vec3 angular_velocity_rad_s = {};
  bool present = true;     // else it waits for an AddBody
  bool kinematic = false;  // it moves as it is told, whatever it meets
  std::string collision_group = {};
  Vec3 force_newton = {}, body_force_newton = {}, torque_newton_m = {};
  double linear_damping_1_s = 0.0, angular_damping_1_s = 0.0;
};

struct Static {
  std::string name = {};
  Shape shape = {};
  std::string material = {};
  Vec3 position_m = {};
  Quat orientation = {};
  Vec3 surface_velocity_m_s = {};  // in its frame, as of a conveyor belt
  std::string collision_group = {};
};

enum class JointKind { kBall, kHinge, kSlider, kFixed, kDistance, kSpring };

// Turns (rad/s, N m) or moves (m/s, N) the body against the other one; with a target it is a servo.
struct Motor {
  double speed = 0.0, most_push = 0.0;
  std::optional<double> target = {}, time_constant_s = {};
};

// Between a body and another one, or the world. Anchors and axis: where they are at the start.
struct Joint {
  std::uint32_t id = 0;
  JointKind kind = JointKind::kBall;
  std::uint32_t body = 0;
  std::optional<std::uint32_t> other_body = {};
  Vec3 anchor_m = {};
  Vec3 axis{0.0, 0.0, 1.0};                                   // kHinge, kSlider
  Vec3 other_anchor_m = {};                                   // kDistance, kSpring
  std::optional<double> length_m = {};                        // kDistance, kSpring
  std::optional<double> least = {}, most = {};                // kHinge: rad; kSlider: m
  std::optional<Motor> motor = {};                            // kHinge, kSlider
  double stiffness_newton_m = 0.0, damping_newton_s_m = 0.0;  // kSpring
  bool can_collide = false;
  std::optional<double> break_force_newton = {}, break_torque_newton_m = {};
};

// How a run is divided into worlds, for run() (soda/run.hpp); a Simulation is not divided.
struct Territory {
  Vec3 origin_m = {};
  double cell_size_m = 1.0;
  std::array<std::int32_t, 3> cells{1, 1, 1};
  std::uint32_t worlds = 1;
};

// A scene to be built. What a default may be, and every limit, is that of the scenario format.
struct SceneParts {
  std::string name = "scene";
  Vec3 gravity_m_s2{0.0, 0.0, -9.81};
  double time_step_s = 1.0 / 60.0;
  std::int64_t steps = 600;  // of a run; a Simulation goes on as long as it is asked to
  std::optional<std::string> quality = {};      // "fast", "balanced", "accurate"
  std::optional<std::int32_t> iterations = {};  // of the contact solver
  std::optional<double> tolerance = {};         // accuracy mode: error of a step, of bodies' widths
  std::vector<Material> materials = {};
  std::vector<Body> bodies = {};
  std::vector<Static> statics = {};
  std::vector<Joint> joints = {};
  std::vector<std::pair<std::string, std::string>> ignored_collisions = {};  // of groups
  Territory territory = {};
};

// As a scenario file: what `soda run` takes.
SODA_API std::string scene_text(const SceneParts& parts);

// Checked and compiled; cheap to copy, and shared between threads.
class SODA_API Scene {
 public:
  // A scenario file; `seed` replaces every seed in it. Throws SceneError, FileError.
  static Scene load(const std::string& file, std::optional<std::uint64_t> seed = {});
  // Its text; `name` stands for the file in messages, mesh files are looked up beside it.
  static Scene parse(std::string_view text, const std::string& name = "scene",
                     std::optional<std::uint64_t> seed = {});
  // Throws SceneError.
  static Scene build(const SceneParts& parts);

  const std::string& name() const;
  double time_step_s() const;
  std::int64_t steps() const;                     // that a run of it makes
  std::vector<std::uint32_t> body_ids() const;    // of all bodies, present or not; ascending
  std::vector<std::string> static_names() const;  // by Solid::id
  double mass_kg(std::uint32_t body) const;       // throws UsageError; of kinematic bodies 1
  std::vector<std::string> warnings() const;      // what the scene hardly means

  struct Impl;
  const std::shared_ptr<const Impl>& impl() const { return impl_; }

 private:
  explicit Scene(std::shared_ptr<const Impl> impl);
  std::shared_ptr<const Impl> impl_;
};

}  // namespace soda
