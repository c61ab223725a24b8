#include "scenarios/inputs.hpp"

#include <algorithm>
#include <utility>

#include "scenarios/cross_checks.hpp"
#include "scenarios/field_table.hpp"
#include "scenarios/input_tables.hpp"
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

const JsonValue* located(const OrientationSpec& spec) {
  return std::visit([](const auto& s) { return s.json; }, spec);
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
    input.material = {spec.friction, spec.restitution};
  }
};

}  // namespace

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

std::optional<std::uint32_t> InputBuilder::body_of(const InputBase& base, FaultList& faults) const {
  if (const std::optional<std::uint32_t> place = find_body(scene_, base.body)) return place;
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
  return whole_steps(*base.time_s, scene_.dt_s, *find_member(*base.json, "time_s"),
                     "give step instead", faults);
}

std::optional<UserInput> InputBuilder::build(const InputSpec& spec, FaultList& faults) {
  const InputBase& base = base_of(spec);
  if (!base.sound) return std::nullopt;
  const bool is_new = check_id(base, faults);
  const std::optional<std::uint32_t> body = body_of(base, faults);
  const std::optional<std::int64_t> step = step_of(base, faults);
  if (!is_new || !body || !step) return std::nullopt;
  UserInput input;
  input.id = static_cast<std::uint32_t>(base.id);
  input.step = *step;
  input.body = physics::BodyId{*body};
  const std::size_t before = faults.size();
  if (scene_.bodies[*body].joints > 0 && std::holds_alternative<RemoveSpec>(spec))
    add_fault(faults, *find_member(*base.json, "body"),
              {"a body that a joint holds", "a body without joints", ""});
  std::visit(FillInput{initial_[*body], input, faults}, spec);
  if (faults.size() > before) return std::nullopt;
  return input;
}

InputLines::InputLines(const Scenario& scenario, std::string file)
    : builder_(scenario.scene, scenario.initial), file_(std::move(file)) {
  for (const UserInput& input : scenario.run.inputs.script)
    builder_.take_id(input.id, "the scenario");
}

std::optional<UserInput> InputLines::read_line(std::string_view line, FaultList& faults) {
  ++line_;
  if (line.find_first_not_of(" \t\r") == std::string_view::npos) return std::nullopt;
  FaultList found;
  const JsonTree tree = parse_json(line, found);
  std::optional<UserInput> input;
  if (const JsonValue* root = tree.root()) {
    InputSpec spec;
    read_choice(kInputLine, *root, &spec, found);
    if (found.empty()) input = builder_.build(spec, found);
  }
  for (InputFault& fault : found) {
    fault.line = line_;
    if (faults.size() < kMaxFaults) faults.push_back(std::move(fault));
  }
  return input;
}

std::optional<UserInput> InputLines::read(std::string_view line) {
  FaultList faults;
  const std::optional<UserInput> input = read_line(line, faults);
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
