// Territories without bodies, and runs in which nothing can happen.
#include <algorithm>
#include <cmath>

#include "scenarios/warnings.hpp"

namespace soda::scenarios {
namespace {

using physics::Aabb;
using physics::BodyId;

constexpr double kFarOutside = 1.0;     // of the domain's longest edge
constexpr std::size_t kIdleWorlds = 4;  // worlds a body
constexpr double kLongFall = 5.0;       // of the largest body's size, in one step from rest

std::string text_of(const Vec3& v) {
  return "[" + about(v.x()) + ", " + about(v.y()) + ", " + about(v.z()) + "]";
}

Aabb domain_of(const models::Grid& grid) {
  Vec3 size;
  for (int i = 0; i < 3; ++i) size[i] = grid.cell_size_m * grid.cells[i];
  return {grid.origin_m, grid.origin_m + size};
}

double distance_m(const Vec3& point, const Aabb& box) {
  return (point - point.cwiseMax(box.min).cwiseMin(box.max)).norm();
}

bool is_there(const Written& written, std::uint32_t body) {
  return !written.is_absent(BodyId{body});
}

// Whether anything but gravity and contacts moves a body, at some time.
bool is_moved(const Written& written) {
  const Scenario& scenario = written.scenario;
  const auto moves = [](const physics::BodyState& state) {
    return !state.linear_velocity_m_s.isZero(0.0) || !state.angular_velocity_rad_s.isZero(0.0);
  };
  const auto pushes = [](const physics::Joint& joint) {
    return joint.motor || joint.kind == physics::JointKind::kSpring;
  };
  const auto carries = [](const physics::StaticBody& body) {
    return !body.surface_velocity_m_s.isZero(0.0);
  };
  return std::ranges::any_of(scenario.scene.bodies, physics::is_forced) ||
         !scenario.scene.drives.empty() || !scenario.run.inputs.script.empty() ||
         std::ranges::any_of(scenario.initial, moves) ||
         std::ranges::any_of(scenario.scene.joints, pushes) ||
         std::ranges::any_of(scenario.scene.statics, carries);
}

}  // namespace

void check_domain(const Written& written, WarningList& warnings) {
  const Scenario& scenario = written.scenario;
  const JsonValue* const place = find_member(*written.document.json, "territory");
  const std::size_t bodies = scenario.initial.size();
  if (!place || bodies == 0) return;
  const Aabb domain = domain_of(scenario.territory.grid);
  const double size = longest_edge_m(domain);
  std::size_t inside = 0;
  for (std::uint32_t i = 0; i < bodies; ++i)
    inside += distance_m(scenario.initial[i].position_m, domain) == 0.0 ? 1 : 0;
  if (inside == 0)
    return warnings.add("empty-territory", *place, [&] {
      return WarningText{"a territory from " + text_of(domain.min) + " to " + text_of(domain.max) +
                             " m that holds no body; all work is that of the nearest worlds",
                         "another origin_m or cell_size_m; body " +
                             std::to_string(scenario.scene.bodies.front().label) + " is at " +
                             text_of(scenario.initial.front().position_m)};
    });
  for (std::uint32_t i = 0; i < bodies; ++i) {
    const double apart = distance_m(scenario.initial[i].position_m, domain);
    if (!is_there(written, i) || apart <= kFarOutside * size) continue;
    warnings.add("outside-territory", *written.places[i], [&] {
      return WarningText{written.name_of(BodyId{i}) + " " + about(apart) +
                             " m outside a territory that is " + about(size) + " m long",
                         "a nearer position, or more cells"};
    });
  }
  if (scenario.territory.worlds > kIdleWorlds * bodies)
    warnings.add("idle-worlds", *place, [&] {
      return WarningText{std::to_string(scenario.territory.worlds) + " worlds for " +
                             std::to_string(bodies) + (bodies == 1 ? " body" : " bodies"),
                         "fewer worlds; most have nothing to do"};
    });
}

void check_time(const Written& written, WarningList& warnings) {
  const Scenario& scenario = written.scenario;
  const JsonValue& root = *written.document.json;
  if (scenario.run.steps == 0) {
    const JsonValue* const steps = find_member(root, "steps");
    warnings.add("no-steps", steps ? *steps : *find_member(root, "duration_s"), [] {
      return WarningText{"a run of 0 steps", "the number of steps, or a duration_s"};
    });
  }
  double size = 0.0;
  for (const Aabb& box : written.boxes.bodies) size = std::max(size, longest_edge_m(box));
  const double dt = scenario.scene.dt_s, fall = scenario.scene.gravity_m_s2.norm() * dt * dt;
  if (!scenario.initial.empty() && fall > kLongFall * size)
    warnings.add("long-step", *find_member(root, "time_step_s"), [&] {
      return WarningText{"a step in which what is at rest falls " + about(fall) +
                             " m, where the largest body has " + about(size) + " m",
                         "a shorter step, such as 0.01 s, or sizes and gravity in metres"};
    });
  // Those of paths come first; a path may be longer than a run.
  const std::size_t of_paths = scenario.run.inputs.script.size() - written.document.inputs.size();
  for (std::size_t i = 0; i < written.document.inputs.size(); ++i) {
    const std::int64_t step = scenario.run.inputs.script[of_paths + i].step;
    if (step < scenario.run.steps || scenario.run.steps == 0) continue;
    const JsonValue* const input =
        std::visit([](const auto& s) { return s.json; }, written.document.inputs[i]);
    warnings.add("late-input", *input, [&] {
      return WarningText{"an input of step " + std::to_string(step) + " in a run of " +
                             std::to_string(scenario.run.steps) + ", in which it does not act",
                         "an earlier one, or a longer run"};
    });
  }
}

void check_gravity(const Written& written, WarningList& warnings) {
  const physics::SceneDescription& scene = written.scenario.scene;
  const Vec3& gravity = scene.gravity_m_s2;
  if (gravity.isZero(0.0) || scene.statics.empty() || scene.bodies.empty()) return;
  double best = -gravity.norm();  // of normal . up
  for (const physics::StaticBody& body : scene.statics) {
    const auto* half = std::get_if<physics::HalfSpace>(&scene.shapes[body.shape]);
    if (!half) return;  // may be what holds them
    best = std::max(best, -gravity.dot(body.orientation * half->normal));
  }
  constexpr double kNone = 1e-9;
  if (best > kNone * gravity.norm()) return;
  warnings.add("gravity-off-floor", *find_member(*written.document.json, "gravity_m_s2"), [&] {
    return WarningText{"gravity " + text_of(gravity) + ", which presses onto no halfspace",
                       "against a normal: floors have [0, 0, 1] by default, gravity then is "
                       "[0, 0, -9.81]"};
  });
}

void check_motion(const Written& written, WarningList& warnings) {
  const JsonValue& root = *written.document.json;
  const JsonValue& gravity = *find_member(root, "gravity_m_s2");
  std::size_t there = 0;
  for (std::uint32_t i = 0; i < written.scenario.initial.size(); ++i)
    there += is_there(written, i) ? 1 : 0;
  if (there == 0 && written.scenario.run.inputs.script.empty())
    return warnings.add("no-bodies", root, [] {
      return WarningText{"no body that takes part", "bodies or generators"};
    });
  if (!written.scenario.scene.gravity_m_s2.isZero(0.0) || is_moved(written)) return;
  if (warnings.has("overlap") || warnings.has("overlap-static")) return;  // they are pushed out
  warnings.add("nothing-moves", gravity, [] {
    return WarningText{"no gravity, and nothing else that moves a body",
                       "gravity, such as [0, 0, -9.81], or a velocity"};
  });
}

}  // namespace soda::scenarios
