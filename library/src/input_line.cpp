// Inputs of the library as the lines of JSON that scenarios have for them.
#include "library/src/json_object.hpp"
#include "library/src/scene_impl.hpp"
#include "scenarios/inputs.hpp"

namespace soda {
namespace {

struct ActionText {
  JsonObject& line;
  const scenarios::Scenario& scenario;

  void operator()(const AddBody& a) const {
    of("add", a.body).set("position_m", a.position_m).set("orientation", a.orientation);
    line.set("velocity_m_s", a.velocity_m_s)
        .set("angular_velocity_rad_s", a.angular_velocity_rad_s);
  }
  void operator()(const RemoveBody& a) const { of("remove", a.body); }
  void operator()(const Push& a) const {
    of("push", a.body).set("impulse_newton_s", a.impulse_newton_s).set("point_m", a.point_m);
  }
  void operator()(const SetVelocity& a) const {
    of("set-velocity", a.body).set("velocity_m_s", a.velocity_m_s);
    line.set("angular_velocity_rad_s", a.angular_velocity_rad_s);
  }
  void operator()(const ChangeMaterial& a) const {
    of("change-material", a.body).set("friction", a.friction).set("restitution", a.restitution);
    line.set("rolling_friction_m", a.rolling_friction_m);
    line.set("torsional_friction_m", a.torsional_friction_m);
  }
  void operator()(const SetMotor& a) const {
    line.set("type", std::string("set-motor")).set("joint", a.joint);
    const bool slides = is_slider(a.joint);
    line.set(slides ? "motor_speed_m_s" : "motor_speed_rad_s", a.speed);
    line.set(slides ? "motor_force_newton" : "motor_torque_newton_m", a.most_push);
    line.set(slides ? "motor_target_m" : "motor_target_rad", a.target);
  }

 private:
  JsonObject& of(const char* type, std::uint32_t body) const {
    return line.set("type", std::string(type)).set("body", body);
  }
  bool is_slider(std::uint32_t label) const {
    for (const physics::Joint& joint : scenario.scene.joints)
      if (joint.label == label) return joint.kind == physics::JointKind::kSlider;
    return false;
  }
};

}  // namespace

std::string input_line(const scenarios::Scenario& scenario, const Input& input) {
  JsonObject line;
  line.set("id", input.id).set("step", input.step);
  std::visit(ActionText{line, scenario}, input.action);
  return line.text();
}

models::UserInput read_input(const scenarios::Scenario& scenario, std::string_view line) {
  return translated([&] { return scenarios::read_input_line(scenario, line, "input"); });
}

}  // namespace soda
