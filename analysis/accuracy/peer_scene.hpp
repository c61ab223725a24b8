// What the modules of other engines share: what of a scene they can take, and its pairs.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>

#include "physics/model/body_state.hpp"
#include "physics/model/scene.hpp"

namespace soda::analysis {

// Why an engine of boxes, spheres, capsules, cylinders and planes cannot run the scene; empty if it
// can. `balls`: whether it is given ball joints.
inline std::string unknown_to_peers(const physics::SceneDescription& scene, bool balls) {
  for (const physics::Shape& shape : scene.shapes)
    if (std::holds_alternative<physics::ConvexHull>(shape) ||
        std::holds_alternative<physics::TriangleMesh>(shape) ||
        std::holds_alternative<physics::Compound>(shape))
      return "hulls, meshes and compounds are not handed over";
  for (const physics::Joint& joint : scene.joints)
    if (!balls || joint.kind != physics::JointKind::kBall || joint.collides)
      return "joints other than balls are not handed over";
  if (std::ranges::any_of(scene.joints, physics::can_break))
    return "joints that can break are not handed over";
  for (const physics::BodyParams& body : scene.bodies) {
    if (body.kinematic) return "kinematic bodies are not handed over";
    if (body.material.rolling_friction_m > 0.0 || body.material.torsional_friction_m > 0.0)
      return "rolling friction is not handed over";
  }
  if (!scene.drives.empty()) return "drives are not handed over";
  if (std::ranges::any_of(scene.bodies, physics::is_forced))
    return "forces and damping are not handed over";
  if (!scene.solver.contact_response) return "contacts without response are not handed over";
  for (const physics::StaticBody& body : scene.statics)
    if (body.surface_velocity_m_s != physics::Vec3::Zero())
      return "moving surfaces are not handed over";
  return {};
}

// The coefficients of a pair as our own step has them.
inline double pair_friction(double a, double b) { return std::sqrt(a * b); }
inline double pair_restitution(double a, double b) { return std::max(a, b); }

// Half the smallest width of a solid.
inline double half_width_m(const physics::Shape& shape) {
  if (const auto* s = std::get_if<physics::Sphere>(&shape)) return s->radius_m;
  if (const auto* s = std::get_if<physics::Box>(&shape)) return s->half_extents_m.minCoeff();
  if (const auto* s = std::get_if<physics::Capsule>(&shape)) return s->radius_m;
  if (const auto* s = std::get_if<physics::Cylinder>(&shape))
    return std::min(s->radius_m, 0.5 * s->length_m);
  return 0.0;
}

}  // namespace soda::analysis
