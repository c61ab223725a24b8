#include "scenarios/inputs.hpp"

#include <algorithm>
#include <utility>

#include "scenarios/cross_checks.hpp"
#include "scenarios/field_table.hpp"
#include "scenarios/input_tables.hpp"
#include "scenarios/joints.hpp"
#include "scenarios/orientation.hpp"
#include "scenarios/read_json.hpp"
#include "scenarios/scenario.hpp"

namespace soda::scenarios {
namespace {

using models::InputKind;
using models::UserInput;

const InputBase& base_of(const InputSpec& spec) {
  return std::visit([](const auto& s) -> const InputBase& { return s; }, spec);
}

// What is special to a kind. `declared`: the body's state in the scene.
struct FillInput {
  const physics::BodyState& declared;
  UserInput& input;
  FaultList& faults;

  void operator()(const AddSpec& spec) const {
    input.kind = InputKind::kAdd;
    input.state = declared;
    if (spec.position_m) input.state.position_m = *spec.position_m;
    if (located(spec.orientation) != nullptr)
      input.state.orientation = orientation_of(spec.orientation, faults);
    if (spec.velocity_m_s) input.state.linear_velocity_m_s = *spec.velocity_m_s;
    if (spec.angular_velocity_rad_s)
      input.state.angular_velocity_rad_s = *spec.angular_velocity_rad_s;
  }
  void operator()(const RemoveSpec&) const { input.kind = InputKind::kRemove; }
  void operator()(const PushSpec& spec) const {
    input.kind = InputKind::kPush;
    input.impulse_newton_s = spec.impulse_newton_s;
    input.point_local_m = spec.point_m;
  }
  void operator()(const SetVelocitySpec& spec) const {
    input.kind = InputKind::kSetVelocity;
    input.sets_linear = spec.velocity_m_s.has_value();
    input.sets_angular = spec.angular_velocity_rad_s.has_value();
    if (input.sets_linear) input.state.linear_velocity_m_s = *spec.velocity_m_s;
    if (input.sets_angular) input.state.angular_velocity_rad_s = *spec.angular_velocity_rad_s;
    if (!input.sets_linear && !input.sets_angular)
      add_fault(faults, *spec.json,
                {"neither velocity_m_s nor angular_velocity_rad_s", "at least one of them", ""});
  }
  void operator()(const ChangeMaterialSpec& spec) const {
    input.kind = InputKind::kChangeMaterial;
    input.material = {spec.friction, spec.restitution, spec.rolling_friction_m,
                      spec.torsional_friction_m};
  }
  void operator()(const SetMotorSpec&) const {}  // of a joint
};

// A key that is meant for the other kind of joint.
const char* key_of_other(const JsonValue& json, const MotorKeys& other) {
  for (const char* const key : {other.speed, other.push, other.target})
    if (find_member(json, key) != nullptr) return key;
  return nullptr;
}

std::optional<UserInput> parse_line(std::string_view line, InputBuilder& builder,
                                    FaultList& faults) {
  const JsonTree tree = parse_json(line, faults);
  const JsonValue* const root = tree.root();
  if (root == nullptr) return std::nullopt;
  InputSpec spec;
  read_choice(kInputLine, *root, &spec, faults);
  return faults.empty() ? builder.build(spec, faults) : std::nullopt;
}

}  // namespace

UserInput read_input_line(const Scenario& scenario, std::string_view line,
                          const std::string& file) {
  FaultList faults;
  InputBuilder builder(scenario);
  const std::optional<UserInput> input = parse_line(line, builder, faults);
  if (!input) throw InputError(file, std::move(faults));
  return *input;
}

bool InputBuilder::check_id(const InputBase& base, FaultList& faults) {
  const JsonValue& member = *find_member(*base.json, "id");
  const auto [first, is_new] =
      ids_.try_emplace(static_cast<std::uint32_t>(base.id), place_of(member));
  if (!is_new)
    add_fault(
        faults, member,
        {describe(member) + " again", "ids that no other input has", "first at " + first->second});
  return is_new;
}

std::optional<std::uint32_t> InputBuilder::body_of(const BodyInputBase& base,
                                                   FaultList& faults) const {
  if (const std::optional<std::uint32_t> place = find_body(scenario_.scene, base.body))
    return place;
  const JsonValue& member = *find_member(*base.json, "body");
  add_fault(faults, member,
            {describe(member) + ", which no body has", "the id of a body of the scene",
             "bodies that are to be added are declared with \"present\": false"});
  return std::nullopt;
}

std::optional<std::int64_t> InputBuilder::step_of(const InputBase& base, FaultList& faults) const {
  if (base.step && base.time_s) {
    add_fault(faults, *find_member(*base.json, "time_s"),
              {"a step and a time", "one of them, or none", ""});
    return std::nullopt;
  }
  if (base.step) return base.step;
  if (!base.time_s) return -1;
  return whole_steps(*base.time_s, scenario_.scene.dt_s, *find_member(*base.json, "time_s"),
                     "give step instead", faults);
}

bool InputBuilder::fill(const BodyInputBase& base, const InputSpec& spec, UserInput& input,
                        FaultList& faults) const {
  const std::optional<std::uint32_t> body = body_of(base, faults);
  if (!body) return false;
  input.body = physics::BodyId{*body};
  const std::size_t before = faults.size();
  if (scenario_.scene.bodies[*body].joints > 0 && std::holds_alternative<RemoveSpec>(spec))
    add_fault(faults, *find_member(*base.json, "body"),
              {"a body that a joint holds", "a body without joints", ""});
  if (scenario_.scene.bodies[*body].kinematic && std::holds_alternative<PushSpec>(spec))
    add_fault(
        faults, *find_member(*base.json, "body"),
        {"a push on a kinematic body, which nothing moves", "set-velocity, or another body", ""});
  std::visit(FillInput{scenario_.declared_state(*body), input, faults}, spec);
  return faults.size() == before;
}

bool InputBuilder::fill(const SetMotorSpec& spec, UserInput& input, FaultList& faults) const {
  const auto& joints = scenario_.scene.joints;
  const auto fault = [&](const char* key, const std::string& found, const char* allowed) {
    add_fault(faults, *find_member(*spec.json, key), {found, allowed, ""});
    return false;
  };
  const auto joint = std::ranges::find(joints, spec.joint, &physics::Joint::label);
  if (joint == joints.end() || !joint->motor)
    return fault("joint", describe(*find_member(*spec.json, "joint")) + ", which no motor has",
                 "the id of a joint with a motor");
  const bool turns = joint->kind == physics::JointKind::kHinge;
  if (const char* const key = key_of_other(*spec.json, turns ? kSliderMotor : kHingeMotor))
    return fault(key, std::string(key) + " for a " + (turns ? "hinge" : "slider"),
                 turns ? "keys of a hinge" : "keys of a slider");
  const double sign = scenario_.motor_signs.at(joint->label);
  const auto of_b = [sign](std::optional<double> value) {
    return value ? std::optional(sign * *value) : std::nullopt;
  };
  input.kind = InputKind::kSetMotor;
  input.body = joint->a;
  input.joint = static_cast<std::uint32_t>(joint - joints.begin());
  input.motor_speed = of_b(turns ? spec.motor_speed_rad_s : spec.motor_speed_m_s);
  input.motor_push = turns ? spec.motor_torque_newton_m : spec.motor_force_newton;
  input.motor_target = of_b(turns ? spec.motor_target_rad : spec.motor_target_m);
  if (!input.motor_speed && !input.motor_push && !input.motor_target) {
    add_fault(faults, *spec.json, {"nothing new of the motor", "a speed, a push or a target", ""});
    return false;
  }
  if (input.motor_target && !are_within_limits(*joint, *input.motor_target))
    return fault(turns ? kHingeMotor.target : kSliderMotor.target,
                 "a target that the joint's limits do not let it reach",
                 "a target within the limits");
  return true;
}

std::optional<UserInput> InputBuilder::build(const InputSpec& spec, FaultList& faults) {
  const InputBase& base = base_of(spec);
  if (!base.sound) return std::nullopt;
  const bool is_new = check_id(base, faults);
  const std::optional<std::int64_t> step = step_of(base, faults);
  UserInput input;
  const auto* const motor = std::get_if<SetMotorSpec>(&spec);
  const bool filled = motor != nullptr
                          ? fill(*motor, input, faults)
                          : fill(static_cast<const BodyInputBase&>(base), spec, input, faults);
  if (!is_new || !step || !filled) return std::nullopt;
  input.id = static_cast<std::uint32_t>(base.id);
  input.step = *step;
  return input;
}

InputLines::InputLines(const Scenario& scenario, std::string file)
    : builder_(scenario), file_(std::move(file)) {
  for (const UserInput& input : scenario.run.inputs.script)
    builder_.take_id(input.id, "the scenario");
  for (const models::CommittedInput& acted : scenario.run.inputs.acted)
    builder_.take_id(acted.input.id, "what acted before");
}

std::optional<UserInput> InputLines::read_line(std::string_view line, FaultList& faults) {
  ++line_;
  if (line.find_first_not_of(" \t\r") == std::string_view::npos) return std::nullopt;
  FaultList found;
  std::optional<UserInput> input = parse_line(line, builder_, found);
  for (InputFault& fault : found) {
    fault.line = line_;
    if (faults.size() < kMaxFaults) faults.push_back(std::move(fault));
  }
  return input;
}

std::optional<UserInput> InputLines::read(std::string_view line) {
  FaultList faults;
  std::optional<UserInput> input = read_line(line, faults);
  if (!faults.empty()) throw InputError(file_, std::move(faults));
  return input;
}

std::vector<UserInput> InputLines::read_all(std::string_view text) {
  FaultList faults;
  std::vector<UserInput> inputs;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    if (std::optional<UserInput> input = read_line(text.substr(0, end), faults)) {
      input->step = std::max<std::int64_t>(input->step, 0);
      inputs.push_back(*input);
    }
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  if (!faults.empty()) {
    sort_by_place(faults);
    throw InputError(file_, std::move(faults));
  }
  return inputs;
}

}  // namespace soda::scenarios
