// A random scene as the text of a scenario file.
#include "analysis/search/fuzz_scene.hpp"
#include "analysis/text/text_table.hpp"

namespace soda::analysis {
namespace {

using physics::Vec3;

std::string number(double value) { return format_exact(value); }

std::string vector(const Vec3& v) {
  return "[" + number(v.x()) + ", " + number(v.y()) + ", " + number(v.z()) + "]";
}

template <class List, class Text>
std::string list(const List& items, const char* between, Text text) {
  std::string all = "[";
  for (const auto& item : items) all += (all.size() > 1 ? between : "") + text(item);
  return all + "]";
}

std::string shape_text(const FuzzShape& shape) {
  const Vec3& s = shape.size_m;
  const std::string radius = "\"radius_m\": " + number(0.5 * s.x());
  const std::string length = ", \"length_m\": " + number(s.z());
  switch (shape.kind) {
    case FuzzShapeKind::kSphere:
      return "{\"type\": \"sphere\", " + radius + "}";
    case FuzzShapeKind::kBox:
      return "{\"type\": \"box\", \"size_m\": " + vector(s) + "}";
    case FuzzShapeKind::kCapsule:
      return "{\"type\": \"capsule\", " + radius + length + "}";
    case FuzzShapeKind::kCylinder:
      return "{\"type\": \"cylinder\", " + radius + length + "}";
    case FuzzShapeKind::kHull:
      return "{\"type\": \"hull\", \"points_m\": " + list(shape.points_m, ", ", vector) + "}";
    case FuzzShapeKind::kHalfSpace:
      return "{\"type\": \"halfspace\"}";
    case FuzzShapeKind::kMesh:
      break;
  }
  const auto corners = [](const std::array<std::uint32_t, 3>& t) {
    return "[" + std::to_string(t[0]) + ", " + std::to_string(t[1]) + ", " + std::to_string(t[2]) +
           "]";
  };
  return "{\"type\": \"mesh\", \"vertices_m\": " + list(shape.points_m, ", ", vector) +
         ", \"triangles\": " + list(shape.triangles, ", ", corners) + "}";
}

// What bodies and statics have in common, without the braces.
std::string common_text(const FuzzStatic& thing, const std::string& material) {
  std::string text = "\"shape\": " + shape_text(thing.shape) + ", \"material\": \"" + material +
                     "\", \"position_m\": " + vector(thing.position_m);
  const physics::Quat& q = thing.orientation;
  if (q.w() != 1.0)
    text += ", \"orientation\": {\"w\": " + number(q.w()) + ", \"x\": " + number(q.x()) +
            ", \"y\": " + number(q.y()) + ", \"z\": " + number(q.z()) + "}";
  return text;
}

std::string body_text(const FuzzBody& body) {
  std::string text = "{\"id\": " + std::to_string(body.id) +
                     ", \"mass_kg\": " + number(body.mass_kg) + ", " +
                     common_text(body, "of body " + std::to_string(body.id));
  if (body.velocity_m_s != Vec3::Zero()) text += ", \"velocity_m_s\": " + vector(body.velocity_m_s);
  if (body.spin_rad_s != Vec3::Zero())
    text += ", \"angular_velocity_rad_s\": " + vector(body.spin_rad_s);
  return text + "}";
}

// A reach without bounds: to be pulled apart is another thing than to be too far to be found.
std::string joint_text(const FuzzJoint& joint, std::size_t id) {
  std::string text = "{\"id\": " + std::to_string(id) + ", \"type\": \"" + joint.type +
                     "\", \"body\": " + std::to_string(joint.body);
  if (joint.other_body) text += ", \"other_body\": " + std::to_string(*joint.other_body);
  text += ", \"anchor_m\": " + vector(joint.anchor_m) + ", \"reach_m\": 1e5";
  if (joint.type == "hinge" || joint.type == "slider") text += ", \"axis\": " + vector(joint.axis);
  const bool turns = joint.type == "hinge";
  if (joint.limits)
    text += std::string(turns ? ", \"min_angle_rad\": " : ", \"min_way_m\": ") +
            number(joint.limits->first) + (turns ? ", \"max_angle_rad\": " : ", \"max_way_m\": ") +
            number(joint.limits->second);
  if (joint.motor)
    text += std::string(turns ? ", \"motor_speed_rad_s\": " : ", \"motor_speed_m_s\": ") +
            number(joint.motor->first) +
            (turns ? ", \"motor_torque_newton_m\": " : ", \"motor_force_newton\": ") +
            number(joint.motor->second);
  if (joint.can_collide) text += ", \"can_collide\": true";
  if (joint.type == "spring")
    text += ", \"length_m\": " + number(joint.length_m) +
            ", \"stiffness_newton_m\": " + number(joint.stiffness_newton_m) +
            ", \"damping_newton_s_m\": " + number(joint.damping_newton_s_m);
  if (joint.type == "distance" || joint.type == "spring")
    text += ", \"other_anchor_m\": " + vector(joint.other_anchor_m);
  return text + "}";
}

std::string materials_text(const FuzzScene& scene) {
  std::string text;
  const auto add = [&](const std::string& name, const FuzzStatic& thing) {
    text += (text.empty() ? "" : ",\n    ") + std::string("{\"name\": \"") + name +
            "\", \"friction\": " + number(thing.friction) +
            ", \"restitution\": " + number(thing.restitution) + "}";
  };
  for (const FuzzBody& body : scene.bodies) add("of body " + std::to_string(body.id), body);
  for (std::size_t i = 0; i < scene.statics.size(); ++i)
    add("of static " + std::to_string(i), scene.statics[i]);
  return "[\n    " + text + "]";
}

}  // namespace

std::string scenario_text(const FuzzScene& scene, const std::string& description) {
  constexpr const char* kBetween = ",\n    ";
  std::size_t id = 0;
  std::string text = "{\n  \"format\": 1,\n  \"name\": \"fuzz-" + std::to_string(scene.seed) +
                     "\",\n  \"description\": \"" + description +
                     "\",\n  \"gravity_m_s2\": [0, 0, " + number(0.0 - scene.gravity_m_s2) +
                     "],\n  \"time_step_s\": " + number(scene.time_step_s) +
                     ",\n  \"steps\": " + std::to_string(scene.steps) +
                     ",\n  \"materials\": " + materials_text(scene) +
                     ",\n  \"bodies\": " + list(scene.bodies, kBetween, body_text);
  if (!scene.statics.empty())
    text += ",\n  \"statics\": " + list(scene.statics, kBetween, [&](const FuzzStatic& thing) {
              const std::string name = "static " + std::to_string(id++);
              return "{\"name\": \"" + name + "\", " + common_text(thing, "of " + name) + "}";
            });
  id = 0;
  if (!scene.joints.empty())
    text += ",\n  \"joints\": " +
            list(scene.joints, kBetween, [&](const FuzzJoint& j) { return joint_text(j, id++); });
  return text + "\n}\n";
}

}  // namespace soda::analysis
