// A built scene as the text of a scenario file.
#include <array>

#include "library/src/json_object.hpp"
#include "soda/scene.hpp"

namespace soda {
namespace {

constexpr const char* kNewLine = ",\n    ";

template <class... Shapes>
std::string shape_text(const std::variant<Shapes...>& shape);

struct ShapeText {
  std::string operator()(const Sphere& s) const {
    return of("sphere").set("radius_m", s.radius_m).text();
  }
  std::string operator()(const Box& s) const { return of("box").set("size_m", s.size_m).text(); }
  std::string operator()(const Capsule& s) const {
    return of("capsule").set("radius_m", s.radius_m).set("length_m", s.length_m).text();
  }
  std::string operator()(const Cylinder& s) const {
    return of("cylinder").set("radius_m", s.radius_m).set("length_m", s.length_m).text();
  }
  std::string operator()(const Hull& s) const {
    return of("hull").raw("points_m", points(s.points_m)).text();
  }
  std::string operator()(const Compound& s) const {
    const auto part = [](const Part& p) {
      return JsonObject()
          .raw("shape", shape_text(p.shape))
          .set("position_m", p.position_m)
          .set("orientation", p.orientation)
          .text();
    };
    return of("compound").raw("parts", json_list(s.parts, part)).text();
  }
  std::string operator()(const Mesh& s) const {
    const auto corners = [](const std::array<std::uint32_t, 3>& triangle) {
      return json_list(triangle, [](std::uint32_t i) { return std::to_string(i); });
    };
    return of("mesh")
        .raw("vertices_m", points(s.vertices_m))
        .raw("triangles", json_list(s.triangles, corners))
        .text();
  }
  std::string operator()(const HalfSpace& s) const {
    return of("halfspace").set("normal", s.normal).set("offset_m", s.offset_m).text();
  }

 private:
  static JsonObject of(const char* type) { return JsonObject().set("type", std::string(type)); }
  static std::string points(const std::vector<Vec3>& points_m) {
    return json_list(points_m, [](const Vec3& point) { return json_text(point); });
  }
};

template <class... Shapes>
std::string shape_text(const std::variant<Shapes...>& shape) {
  return std::visit(ShapeText(), shape);
}

std::string material_text(const Material& m) {
  return JsonObject()
      .set("name", m.name)
      .set("friction", m.friction)
      .set("restitution", m.restitution)
      .set_unless("rolling_friction_m", m.rolling_friction_m, 0.0)
      .set_unless("torsional_friction_m", m.torsional_friction_m, 0.0)
      .text();
}

std::string body_text(const Body& b) {
  JsonObject body;
  body.set("id", b.id).raw("shape", shape_text(b.shape)).set("material", b.material);
  body.set("mass_kg", b.mass_kg).set("density_kg_m3", b.density_kg_m3);
  body.set("position_m", b.position_m);
  body.set_unless("orientation", b.orientation, Quat());
  body.set_unless("velocity_m_s", b.velocity_m_s, Vec3());
  body.set_unless("angular_velocity_rad_s", b.angular_velocity_rad_s, Vec3());
  body.set_unless("present", b.present, true).set_unless("kinematic", b.kinematic, false);
  body.set_unless("collision_group", b.collision_group, std::string());
  body.set_unless("force_newton", b.force_newton, Vec3());
  body.set_unless("body_force_newton", b.body_force_newton, Vec3());
  body.set_unless("torque_newton_m", b.torque_newton_m, Vec3());
  body.set_unless("linear_damping_1_s", b.linear_damping_1_s, 0.0);
  body.set_unless("angular_damping_1_s", b.angular_damping_1_s, 0.0);
  return body.text();
}

std::string static_text(const Static& s) {
  return JsonObject()
      .set("name", s.name)
      .raw("shape", shape_text(s.shape))
      .set("material", s.material)
      .set_unless("position_m", s.position_m, Vec3())
      .set_unless("orientation", s.orientation, Quat())
      .set_unless("surface_velocity_m_s", s.surface_velocity_m_s, Vec3())
      .set_unless("collision_group", s.collision_group, std::string())
      .text();
}

// Limits and motors have keys of their own for what turns and for what slides. What a kind does not
// have is written down as well where it is given: then the reader says so.
std::string joint_text(const Joint& j) {
  constexpr std::array kNames{"ball", "hinge", "slider", "fixed", "distance", "spring"};
  const bool slides = j.kind == JointKind::kSlider, turns = j.kind == JointKind::kHinge;
  const bool stretches = j.kind == JointKind::kDistance || j.kind == JointKind::kSpring;
  JsonObject joint;
  joint.set("type", std::string(kNames[static_cast<std::size_t>(j.kind)])).set("id", j.id);
  joint.set("body", j.body).set("other_body", j.other_body).set("anchor_m", j.anchor_m);
  if (slides || turns) joint.set("axis", j.axis);
  if (stretches) joint.set("other_anchor_m", j.other_anchor_m);
  joint.set("length_m", j.length_m);
  joint.set(slides ? "min_way_m" : "min_angle_rad", j.least);
  joint.set(slides ? "max_way_m" : "max_angle_rad", j.most);
  if (j.motor) {
    joint.set(slides ? "motor_speed_m_s" : "motor_speed_rad_s", j.motor->speed);
    joint.set(slides ? "motor_force_newton" : "motor_torque_newton_m", j.motor->most_push);
    joint.set(slides ? "motor_target_m" : "motor_target_rad", j.motor->target);
    joint.set("motor_time_constant_s", j.motor->time_constant_s);
  }
  if (j.kind == JointKind::kSpring) joint.set("stiffness_newton_m", j.stiffness_newton_m);
  joint.set_unless("damping_newton_s_m", j.damping_newton_s_m, 0.0);
  joint.set_unless("can_collide", j.can_collide, false);
  joint.set("break_force_newton", j.break_force_newton);
  joint.set("break_torque_newton_m", j.break_torque_newton_m);
  return joint.text();
}

std::string territory_text(const Territory& t) {
  return JsonObject()
      .set("origin_m", t.origin_m)
      .set("cell_size_m", t.cell_size_m)
      .raw("cells", json_list(t.cells, [](std::int32_t n) { return std::to_string(n); }))
      .set("worlds", t.worlds)
      .text();
}

}  // namespace

std::string scene_text(const SceneParts& parts) {
  const auto list = [](const auto& items, const auto& text) {
    return items.empty() ? std::string("[]")
                         : "[\n    " + json_list(items, text, kNewLine).substr(1);
  };
  const auto ignored = [](const std::pair<std::string, std::string>& groups) {
    return JsonObject().set("group", groups.first).set("with", groups.second).text();
  };
  JsonObject solver;
  solver.set("quality", parts.quality).set("iterations", parts.iterations);
  std::vector<std::pair<std::string, std::string>> fields = {
      {"format", "1"},
      {"name", json_text(parts.name)},
      {"gravity_m_s2", json_text(parts.gravity_m_s2)},
      {"time_step_s", json_text(parts.time_step_s)},
      {"steps", json_text(parts.steps)},
      {"solver", solver.text()}};
  if (parts.tolerance)
    fields.emplace_back("accuracy", JsonObject().set("tolerance", parts.tolerance).text());
  fields.emplace_back("materials", list(parts.materials, material_text));
  fields.emplace_back("bodies", list(parts.bodies, body_text));
  fields.emplace_back("statics", list(parts.statics, static_text));
  fields.emplace_back("joints", list(parts.joints, joint_text));
  fields.emplace_back("ignored_collisions", list(parts.ignored_collisions, ignored));
  fields.emplace_back("territory", territory_text(parts.territory));
  std::string text = "{";
  for (const auto& [key, value] : fields)
    text += (text.size() > 1 ? ",\n  \"" : "\n  \"") + key + "\": " + value;
  return text + "\n}\n";
}

}  // namespace soda
