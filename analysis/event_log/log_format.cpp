#include "analysis/event_log/log_format.hpp"

#include <xxhash.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

namespace soda::analysis {
namespace {

// Bytes of one contact impulse and of a body without any; see put_state.
constexpr std::size_t kImpulseBytes = 3 * 4 + 4 * 8;
constexpr std::size_t kStateBytes = 13 * 8 + 8;
// Broken joints stand among the impulses, after the others: each as its label for a feature.
constexpr std::uint32_t kBrokenPart = 0xffffffffu;
constexpr std::size_t kTerritoryChangeBytes = 3 * 4;

void put_vec3(ByteBuffer& out, const physics::Vec3& v) {
  for (int i = 0; i < 3; ++i) put(out, v[i]);
}

physics::Vec3 take_vec3(ByteReader& in) {
  physics::Vec3 v;
  for (int i = 0; i < 3; ++i) v[i] = in.take_double();
  return v;
}

void put_state(ByteBuffer& out, const physics::BodyState& state) {
  put_vec3(out, state.position_m);
  put(out, state.orientation.w());
  put(out, state.orientation.x());
  put(out, state.orientation.y());
  put(out, state.orientation.z());
  put_vec3(out, state.linear_velocity_m_s);
  put_vec3(out, state.angular_velocity_rad_s);
  put(out, static_cast<std::uint64_t>(state.impulses.size() + state.broken_joints.size()));
  const auto put_impulse = [&out](const physics::ContactImpulse& impulse) {
    put(out, physics::index_of(impulse.other));
    put(out, impulse.part);
    put(out, impulse.feature);
    put(out, impulse.normal_newton_s);
    put_vec3(out, impulse.friction_newton_s);
  };
  for (const physics::ContactImpulse& impulse : state.impulses) put_impulse(impulse);
  for (const std::uint32_t joint : state.broken_joints)
    put_impulse({physics::BodyId{0}, kBrokenPart, joint, 0.0, physics::Vec3::Zero()});
}

physics::BodyState take_state(ByteReader& in) {
  physics::BodyState state;
  state.position_m = take_vec3(in);
  state.orientation.w() = in.take_double();
  state.orientation.x() = in.take_double();
  state.orientation.y() = in.take_double();
  state.orientation.z() = in.take_double();
  state.linear_velocity_m_s = take_vec3(in);
  state.angular_velocity_rad_s = take_vec3(in);
  state.impulses.resize(in.take_count(kImpulseBytes));
  for (physics::ContactImpulse& impulse : state.impulses) {
    impulse.other = static_cast<physics::BodyId>(in.take<std::uint32_t>());
    impulse.part = in.take<std::uint32_t>();
    impulse.feature = in.take<std::uint32_t>();
    impulse.normal_newton_s = in.take_double();
    impulse.friction_newton_s = take_vec3(in);
    if (impulse.part == kBrokenPart) state.broken_joints.push_back(impulse.feature);
  }
  state.impulses.resize(state.impulses.size() - state.broken_joints.size());
  return state;
}

void put_input(ByteBuffer& out, const models::CommittedInput& committed) {
  const models::UserInput& input = committed.input;
  put(out, input.id);
  put(out, input.step);
  put(out, static_cast<std::uint32_t>(input.kind));
  put(out, physics::index_of(input.body));
  put_state(out, input.state);
  put(out, static_cast<std::uint8_t>(input.sets_linear));
  put(out, static_cast<std::uint8_t>(input.sets_angular));
  put_vec3(out, input.impulse_newton_s);
  put_vec3(out, input.point_local_m);
  put(out, input.material.friction);
  put(out, input.material.restitution);
  put(out, input.material.rolling_friction_m);
  put(out, input.material.torsional_friction_m);
  put(out, input.joint);
  for (const auto& value : {input.motor_speed, input.motor_push, input.motor_target}) {
    put(out, static_cast<std::uint8_t>(value.has_value()));
    put(out, value.value_or(0.0));
  }
  put(out, committed.asked_step);
  put(out, static_cast<std::uint8_t>(committed.had_effect));
}

models::CommittedInput take_input(ByteReader& in) {
  models::CommittedInput committed;
  models::UserInput& input = committed.input;
  input.id = in.take<std::uint32_t>();
  input.step = in.take<std::int64_t>();
  const auto kind = in.take<std::uint32_t>();
  if (kind >= models::kInputKinds)
    throw DecodeError("holds an input of kind " + std::to_string(kind));
  input.kind = static_cast<models::InputKind>(kind);
  input.body = static_cast<physics::BodyId>(in.take<std::uint32_t>());
  input.state = take_state(in);
  input.sets_linear = in.take_flag();
  input.sets_angular = in.take_flag();
  input.impulse_newton_s = take_vec3(in);
  input.point_local_m = take_vec3(in);
  input.material.friction = in.take_double();
  input.material.restitution = in.take_double();
  input.material.rolling_friction_m = in.take_double();
  input.material.torsional_friction_m = in.take_double();
  input.joint = in.take<std::uint32_t>();
  for (auto* const value : {&input.motor_speed, &input.motor_push, &input.motor_target}) {
    const bool given = in.take_flag();
    const double number = in.take_double();
    if (given) *value = number;
  }
  committed.asked_step = in.take<std::int64_t>();
  committed.had_effect = in.take_flag();
  return committed;
}

bool is_finite(const models::UserInput& input) {
  const physics::BodyState& state = input.state;
  return state.position_m.allFinite() && state.orientation.coeffs().allFinite() &&
         state.linear_velocity_m_s.allFinite() && state.angular_velocity_rad_s.allFinite() &&
         input.impulse_newton_s.allFinite() && input.point_local_m.allFinite() &&
         std::isfinite(input.material.friction) && std::isfinite(input.material.restitution) &&
         std::isfinite(input.material.rolling_friction_m) &&
         std::isfinite(input.material.torsional_friction_m) &&
         std::isfinite(input.motor_speed.value_or(0.0)) &&
         std::isfinite(input.motor_push.value_or(0.0)) &&
         std::isfinite(input.motor_target.value_or(0.0));
}

// What follows says how the states are written.
enum class StatesForm : std::uint8_t { kNone, kWhole, kDifference };

void take_states(ByteReader& in, const LoggedStates* before, const StepHead& head, double between_s,
                 LoggedStep& logged) {
  logged.has_states = head.has_states;
  if (!head.has_states) return;
  if (!head.is_whole && before == nullptr)
    throw DecodeError("holds a difference to states that are not there");
  const LoggedStates nothing;
  LoggedStates now = decode_difference(in, head.is_whole ? nothing : *before, between_s);
  logged.ids = std::move(now.ids);
  logged.states = std::move(now.states);
}

void check_inputs(const StepHead& head, const StepInLog& in_log) {
  const std::size_t bodies = in_log.bodies;
  for (const models::CommittedInput& committed : head.inputs) {
    const models::UserInput& input = committed.input;
    const std::string name = "holds input " + std::to_string(input.id);
    if (physics::index_of(input.body) >= bodies)
      throw DecodeError(name + " to body id " + std::to_string(physics::index_of(input.body)) +
                        " of " + std::to_string(bodies));
    if (in_log.is_first ? input.step < 0 : input.step != head.step - 1)
      throw DecodeError(name + " of step " + std::to_string(input.step));
    if (!is_finite(input)) throw DecodeError(name + " with a value that is no number");
  }
}

}  // namespace

std::uint64_t checksum(std::span<const unsigned char> bytes) {
  return XXH3_64bits(bytes.data(), bytes.size());
}

ByteBuffer encode_file_header() {
  ByteBuffer out(kLogMagic.begin(), kLogMagic.end());
  put(out, kLogVersion);
  put(out, std::uint32_t{0});
  put(out, checksum(out));
  return out;
}

void decode_file_header(std::span<const unsigned char> bytes) {
  if (bytes.size() < kFileHeaderBytes ||
      !std::equal(kLogMagic.begin(), kLogMagic.end(), bytes.begin())) {
    throw DecodeError("is no soda log");
  }
  ByteReader in(bytes.subspan(kLogMagic.size()));
  const auto version = in.take<std::uint32_t>();
  in.take<std::uint32_t>();
  if (in.take<std::uint64_t>() != checksum(bytes.first(kFileHeaderBytes - 8))) {
    throw DecodeError("has a damaged file header");
  }
  if (version != kLogVersion) {
    throw DecodeError("has log format version " + std::to_string(version) +
                      "; this soda reads version " + std::to_string(kLogVersion));
  }
}

ByteBuffer encode(const BlockHeader& header) {
  ByteBuffer out;
  put(out, static_cast<std::uint32_t>(header.type));
  put(out, header.index);
  put(out, header.raw_bytes);
  put(out, header.stored_bytes);
  put(out, header.stored_checksum);
  put(out, checksum(out));
  return out;
}

BlockHeader decode_block_header(std::span<const unsigned char> bytes) {
  ByteReader in(bytes);
  BlockHeader header;
  header.type = static_cast<BlockType>(in.take<std::uint32_t>());
  header.index = in.take<std::uint32_t>();
  header.raw_bytes = in.take<std::uint64_t>();
  header.stored_bytes = in.take<std::uint64_t>();
  header.stored_checksum = in.take<std::uint64_t>();
  if (in.take<std::uint64_t>() != checksum(bytes.first(kBlockHeaderBytes - 8))) {
    throw DecodeError("block header does not match its checksum");
  }
  in.expect_end();
  return header;
}

ByteBuffer encode(const LoggedScenario& scenario) {
  ByteBuffer out;
  put(out, scenario.program_version);
  put(out, scenario.file);
  put(out, scenario.text);
  put(out, scenario.dt_s);
  return out;
}

LoggedScenario decode_scenario(std::span<const unsigned char> bytes) {
  ByteReader in(bytes);
  LoggedScenario scenario;
  scenario.program_version = in.take_string();
  scenario.file = in.take_string();
  scenario.text = in.take_string();
  scenario.dt_s = in.take_double();
  in.expect_end();
  return scenario;
}

ByteBuffer encode(const scenarios::MeshFile& mesh) {
  ByteBuffer out;
  put(out, mesh.name);
  put(out, mesh.bytes);
  return out;
}

scenarios::MeshFile decode_mesh(std::span<const unsigned char> bytes) {
  ByteReader in(bytes);
  scenarios::MeshFile mesh;
  mesh.name = in.take_string();
  mesh.bytes = in.take_string();
  in.expect_end();
  return mesh;
}

ByteBuffer encode_labels(std::span<const std::uint32_t> labels) {
  ByteBuffer out;
  put(out, static_cast<std::uint64_t>(labels.size()));
  for (const std::uint32_t label : labels) put(out, label);
  return out;
}

std::vector<std::uint32_t> decode_labels(std::span<const unsigned char> bytes) {
  ByteReader in(bytes);
  std::vector<std::uint32_t> labels(in.take_count(sizeof(std::uint32_t)));
  for (std::uint32_t& label : labels) label = in.take<std::uint32_t>();
  in.expect_end();
  return labels;
}

ByteBuffer encode_step(const LoggedStep& step, const LoggedStates* before, double between_s) {
  const StatesForm form = !step.has_states    ? StatesForm::kNone
                          : before == nullptr ? StatesForm::kWhole
                                              : StatesForm::kDifference;
  ByteBuffer events;
  put(events, static_cast<std::uint64_t>(step.inputs.size()));
  for (const models::CommittedInput& input : step.inputs) put_input(events, input);
  put(events, static_cast<std::uint64_t>(step.territory_changes.size()));
  for (const models::TerritoryChange& change : step.territory_changes) {
    put(events, change.cell);
    put(events, models::index_of(change.from));
    put(events, models::index_of(change.to));
  }
  ByteBuffer out;
  put(out, step.step);
  put(out, step.digest);
  put(out, static_cast<std::uint8_t>(form));
  put(out, static_cast<std::uint64_t>(events.size()));
  const std::size_t index_bytes_at = out.size();
  put(out, std::uint64_t{0});
  out.insert(out.end(), events.begin(), events.end());
  if (form == StatesForm::kNone) return out;
  const LoggedStates nothing;
  const std::uint64_t index_bytes = put_difference(
      out, step.ids, step.states, form == StatesForm::kWhole ? nothing : *before, between_s);
  std::memcpy(out.data() + index_bytes_at, &index_bytes, sizeof index_bytes);
  return out;
}

StepParts step_parts(std::span<const unsigned char> beginning) {
  ByteReader in(beginning);
  in.skip(8 + 8 + 1);
  StepParts parts;
  parts.head_bytes = kStepHeadBytes + in.take<std::uint64_t>();
  parts.index_bytes = in.take<std::uint64_t>();
  return parts;
}

StepHead decode_step_head(ByteReader& in, const StepInLog& in_log) {
  StepHead head;
  head.step = in.take<std::int64_t>();
  head.digest = in.take<std::uint64_t>();
  const auto form = in.take<std::uint8_t>();
  if (form > static_cast<std::uint8_t>(StatesForm::kDifference))
    throw DecodeError("holds states of form " + std::to_string(form));
  head.has_states = StatesForm{form} != StatesForm::kNone;
  head.is_whole = StatesForm{form} == StatesForm::kWhole;
  const auto event_bytes = in.take<std::uint64_t>();
  in.take<std::uint64_t>();  // of who reads parts
  ByteReader events(in.take_span(event_bytes));
  head.inputs.resize(events.take_count(kStateBytes));
  for (models::CommittedInput& input : head.inputs) input = take_input(events);
  head.territory_changes.resize(events.take_count(kTerritoryChangeBytes));
  for (models::TerritoryChange& change : head.territory_changes) {
    change.step = head.step - 1;
    change.cell = events.take<std::uint32_t>();
    change.from = models::WorldId{events.take<std::uint32_t>()};
    change.to = models::WorldId{events.take<std::uint32_t>()};
  }
  events.expect_end();
  check_inputs(head, in_log);
  return head;
}

LoggedStep decode_step(std::span<const unsigned char> bytes, const StepInLog& in_log,
                       const LoggedStates* before, double between_s) {
  ByteReader in(bytes);
  StepHead head = decode_step_head(in, in_log);
  LoggedStep logged;
  logged.step = head.step;
  logged.digest = head.digest;
  take_states(in, before, head, between_s, logged);
  in.expect_end();
  logged.inputs = std::move(head.inputs);
  logged.territory_changes = std::move(head.territory_changes);
  check_ids(logged.ids, in_log.bodies);
  return logged;
}

ByteBuffer encode(const LoggedEnd& end) {
  ByteBuffer out;
  put(out, end.steps);
  put(out, end.digest);
  put(out, static_cast<std::uint8_t>(end.execution_digest.has_value()));
  put(out, end.execution_digest.value_or(0));
  return out;
}

LoggedEnd decode_end(std::span<const unsigned char> bytes) {
  ByteReader in(bytes);
  LoggedEnd end;
  end.steps = in.take<std::int64_t>();
  end.digest = in.take<std::uint64_t>();
  const bool was_virtual = in.take_flag();
  const auto execution_digest = in.take<std::uint64_t>();
  if (was_virtual) end.execution_digest = execution_digest;
  in.expect_end();
  return end;
}

}  // namespace soda::analysis
