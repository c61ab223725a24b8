#include "library/src/moment.hpp"

#include <xxhash.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <functional>
#include <tuple>
#include <type_traits>

#include "soda/errors.hpp"

namespace soda {
namespace {

static_assert(std::endian::native == std::endian::little, "snapshots are little-endian");

constexpr std::uint32_t kMagic = 0x31534453;  // "SDS1": also the version
constexpr std::size_t kHead = 4 + 4 + 8 + 8;  // magic, room, fingerprint, checksum
constexpr std::size_t kMotionNumbers = 13;
constexpr std::size_t kStateBytes = 4 + 8 * kMotionNumbers + 4 + 4, kImpulseBytes = 12 + 8 * 4;

// Of motors that have a target and of others.
constexpr std::size_t kMaterialBytes = 4 + 8 * 4, kMotorBytes = 4 + 1 + 8 * 3;
constexpr std::size_t kInputBytes = 4 + 8 + 4 + 4 + 8 * kMotionNumbers + 2 + 8 * 10 + 4 + 3 * 9;

std::array<double, kMotionNumbers> motion(const physics::BodyState& s) {
  const physics::Vec3 &x = s.position_m, &v = s.linear_velocity_m_s, &w = s.angular_velocity_rad_s;
  const physics::Quat& q = s.orientation;
  return {x.x(), x.y(), x.z(), q.w(), q.x(), q.y(), q.z(),
          v.x(), v.y(), v.z(), w.x(), w.y(), w.z()};
}

void set_motion(const std::array<double, kMotionNumbers>& n, physics::BodyState& s) {
  s.position_m = {n[0], n[1], n[2]};
  s.orientation = physics::Quat(n[3], n[4], n[5], n[6]);
  s.linear_velocity_m_s = {n[7], n[8], n[9]};
  s.angular_velocity_rad_s = {n[10], n[11], n[12]};
}

// Into memory that is large enough.
class Out {
 public:
  explicit Out(std::byte* to) : to_(to) {}
  template <class T>
  void put(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    std::memcpy(to_, &value, sizeof value);
    to_ += sizeof value;
  }
  void put(const physics::Vec3& v) { put(std::array{v.x(), v.y(), v.z()}); }
  void count(std::size_t n) { put(static_cast<std::uint32_t>(n)); }
  void put(const std::optional<double>& value) {
    put(static_cast<std::uint8_t>(value.has_value()));
    put(value.value_or(0.0));
  }
  const std::byte* end() const { return to_; }

 private:
  std::byte* to_;
};

[[noreturn]] void refuse(const char* why) {
  throw UsageError(std::string("a snapshot that cannot be restored: ") + why);
}

// From bytes that may end anywhere.
class In {
 public:
  explicit In(std::span<const std::byte> from) : from_(from) {}
  template <class T>
  T take() {
    static_assert(std::is_trivially_copyable_v<T>);
    if (from_.size() < sizeof(T)) refuse("it ends early");
    T value;
    std::memcpy(&value, from_.data(), sizeof value);
    from_ = from_.subspan(sizeof value);
    return value;
  }
  double number() {
    const double value = take<double>();
    if (!std::isfinite(value)) refuse("it holds what is no number");
    return value;
  }
  physics::Vec3 vector() {
    const double x = number(), y = number(), z = number();
    return {x, y, z};
  }
  double at_least_zero() {
    const double value = number();
    if (value < 0.0) refuse("it holds a negative size");
    return value;
  }
  physics::Material material() {
    constexpr double kMostRestitution = 1.0;
    physics::Material m;
    for (double* const value :
         {&m.friction, &m.restitution, &m.rolling_friction_m, &m.torsional_friction_m})
      *value = at_least_zero();
    if (m.restitution > kMostRestitution) refuse("it holds a restitution above 1");
    return m;
  }
  std::int64_t step() {
    constexpr std::int64_t kMostSteps = std::int64_t{1} << 53;
    const auto value = take<std::int64_t>();
    if (value < 0 || value > kMostSteps) refuse("it holds a step that no run has");
    return value;
  }
  void motion(physics::BodyState& state) {
    constexpr double kUnit = 1e-6;
    std::array<double, kMotionNumbers> all;
    for (double& value : all) value = number();
    set_motion(all, state);
    if (!(std::abs(state.orientation.squaredNorm() - 1.0) <= kUnit))
      refuse("it holds an orientation whose length is not 1");
  }
  // Of items of at least so many bytes.
  std::size_t count(std::size_t bytes) {
    const auto n = take<std::uint32_t>();
    if (n > from_.size() / bytes) refuse("it ends early");
    return n;
  }
  std::uint32_t below(std::size_t limit) {
    const auto n = take<std::uint32_t>();
    if (n >= limit) refuse("it names what the scene does not have");
    return n;
  }
  std::optional<double> optional() {
    const bool is_given = take<std::uint8_t>() != 0;
    const double value = number();
    return is_given ? std::optional(value) : std::nullopt;
  }
  bool at_end() const { return from_.empty(); }

 private:
  std::span<const std::byte> from_;
};

void put_input(const models::UserInput& input, Out& out) {
  out.put(input.id);
  out.put(input.step);
  out.put(static_cast<std::uint32_t>(input.kind));
  out.put(physics::index_of(input.body));
  out.put(motion(input.state));
  out.put(static_cast<std::uint8_t>(input.sets_linear));
  out.put(static_cast<std::uint8_t>(input.sets_angular));
  out.put(input.impulse_newton_s);
  out.put(input.point_local_m);
  out.put(std::array{input.material.friction, input.material.restitution,
                     input.material.rolling_friction_m, input.material.torsional_friction_m});
  out.put(input.joint);
  for (const auto* value : {&input.motor_speed, &input.motor_push, &input.motor_target})
    out.put(*value);
}

models::UserInput take_input(const physics::SceneDescription& scene, In& in) {
  models::UserInput input;
  input.id = in.take<std::uint32_t>();
  input.step = in.step();
  input.kind = static_cast<models::InputKind>(in.below(models::kInputKinds));
  input.body = physics::BodyId{in.below(scene.bodies.size())};
  in.motion(input.state);
  input.sets_linear = in.take<std::uint8_t>() != 0;
  input.sets_angular = in.take<std::uint8_t>() != 0;
  input.impulse_newton_s = in.vector();
  input.point_local_m = in.vector();
  input.material = in.material();
  input.joint = in.take<std::uint32_t>();
  const bool of_motor = input.kind == models::InputKind::kSetMotor;
  if (of_motor && (input.joint >= scene.joints.size() || !scene.joints[input.joint].motor))
    refuse("it names what the scene does not have");
  for (auto* const value : {&input.motor_speed, &input.motor_push, &input.motor_target})
    *value = in.optional();
  if (input.motor_push.value_or(0.0) < 0.0) refuse("it holds a negative size");
  return input;
}

void put_state(physics::BodyId id, const physics::BodyState& state, Out& out) {
  out.put(physics::index_of(id));
  out.put(motion(state));
  out.count(state.impulses.size());
  out.count(state.broken_joints.size());
  for (const physics::ContactImpulse& impulse : state.impulses) {
    out.put(std::array{physics::index_of(impulse.other), impulse.part, impulse.feature});
    out.put(impulse.normal_newton_s);
    out.put(impulse.friction_newton_s);
  }
  for (const std::uint32_t joint : state.broken_joints) out.put(joint);
}

bool is_in(const physics::SceneDescription& scene, physics::BodyId id) {
  if (!physics::is_static(id)) return physics::index_of(id) < scene.bodies.size();
  return id == physics::kWorldBody || physics::static_index_of(id) < scene.statics.size();
}

auto place_of(const physics::ContactImpulse& impulse) {
  return std::tuple(impulse.other, impulse.part, impulse.feature);
}

void take_state(const physics::SceneDescription& scene, In& in, physics::BodyState& state) {
  in.motion(state);
  state.impulses.resize(in.count(kImpulseBytes));
  state.broken_joints.resize(in.count(4));
  for (physics::ContactImpulse& impulse : state.impulses) {
    impulse.other = physics::BodyId{in.take<std::uint32_t>()};
    if (!is_in(scene, impulse.other)) refuse("it names what the scene does not have");
    impulse.part = in.take<std::uint32_t>();
    impulse.feature = in.take<std::uint32_t>();
    impulse.normal_newton_s = in.number();
    impulse.friction_newton_s = in.vector();
  }
  for (std::uint32_t& joint : state.broken_joints) joint = in.take<std::uint32_t>();
  const auto is_in_order = [](const auto& a, const auto& b) { return place_of(a) < place_of(b); };
  if (std::ranges::adjacent_find(state.impulses, std::not_fn(is_in_order)) !=
          state.impulses.end() ||
      std::ranges::adjacent_find(state.broken_joints, std::greater_equal()) !=
          state.broken_joints.end())
    refuse("its contacts or broken joints are in no order");
}

// Bodies have only their own joints broken.
void check_broken(const physics::SceneDescription& scene, physics::BodyId id,
                  std::span<const std::uint32_t> broken) {
  if (broken.empty()) return;
  const auto known = std::ranges::count_if(scene.joints, [&](const physics::Joint& joint) {
    return (joint.a == id || joint.b == id) && can_break(joint) &&
           std::ranges::binary_search(broken, joint.label);
  });
  if (static_cast<std::size_t>(known) != broken.size()) refuse("it has what cannot break broken");
}

std::size_t size_of(const Moment& moment) {
  std::size_t bytes = kHead + 8 + 4 * 4 + kStateBytes * moment.states.size() +
                      kMaterialBytes * moment.changes.materials.size() +
                      kMotorBytes * moment.changes.motors.size() +
                      kInputBytes * moment.given.size();
  for (const physics::BodyState& state : moment.states)
    bytes += kImpulseBytes * state.impulses.size() + 4 * state.broken_joints.size();
  return bytes;
}

void take_changes(const physics::SceneDescription& scene, In& in, models::SceneChanges& changes) {
  changes = {};
  for (std::size_t n = in.count(kMaterialBytes); n > 0; --n) {
    const physics::BodyId body{in.below(scene.bodies.size())};
    models::set_material(body, in.material(), changes);
  }
  for (std::size_t n = in.count(kMotorBytes); n > 0; --n) {
    const std::uint32_t joint = in.below(scene.joints.size());
    if (!scene.joints[joint].motor) refuse("it names what the scene does not have");
    physics::JointMotor motor;
    motor.speed = in.number();
    motor.most_push = in.at_least_zero();
    motor.target = in.optional();
    models::set_motor(joint, motor, changes);
  }
}

}  // namespace

void encode(const Moment& moment, std::uint64_t fingerprint, std::vector<std::byte>& bytes) {
  bytes.resize(size_of(moment));
  Out out(bytes.data() + kHead);
  out.put(moment.step);
  out.count(moment.ids.size());
  for (std::size_t i = 0; i < moment.ids.size(); ++i)
    put_state(moment.ids[i], moment.states[i], out);
  out.count(moment.changes.materials.size());
  for (const models::MaterialChange& m : moment.changes.materials) {
    out.put(physics::index_of(m.body));
    out.put(std::array{m.friction, m.restitution, m.rolling_friction_m, m.torsional_friction_m});
  }
  out.count(moment.changes.motors.size());
  for (const models::MotorChange& m : moment.changes.motors) {
    out.put(m.joint);
    out.put(std::array{m.speed, m.most_push});
    out.put(m.target);
  }
  out.count(moment.given.size());
  for (const models::UserInput& input : moment.given) put_input(input, out);
  Out head(bytes.data());
  head.put(kMagic);
  head.put(std::uint32_t{0});
  head.put(fingerprint);
  head.put(std::uint64_t{XXH3_64bits(bytes.data() + kHead, bytes.size() - kHead)});
}

void decode(std::span<const std::byte> bytes, const physics::SceneDescription& scene,
            std::uint64_t fingerprint, Moment& moment) {
  In in(bytes);
  if (in.take<std::uint32_t>() != kMagic || in.take<std::uint32_t>() != 0) refuse("it is none");
  if (in.take<std::uint64_t>() != fingerprint) refuse("it is of another scene");
  const auto checksum = in.take<std::uint64_t>();
  if (checksum != XXH3_64bits(bytes.data() + kHead, bytes.size() - kHead)) refuse("it is damaged");
  moment.step = in.step();
  const std::size_t bodies = in.count(kStateBytes);
  moment.ids.resize(bodies);
  moment.states.resize(bodies);
  for (std::size_t i = 0; i < bodies; ++i) {
    moment.ids[i] = physics::BodyId{in.below(scene.bodies.size())};
    if (i > 0 && moment.ids[i] <= moment.ids[i - 1]) refuse("its bodies are in no order");
    take_state(scene, in, moment.states[i]);
    check_broken(scene, moment.ids[i], moment.states[i].broken_joints);
  }
  take_changes(scene, in, moment.changes);
  moment.given.clear();
  for (std::size_t n = in.count(kInputBytes); n > 0; --n)
    moment.given.push_back(take_input(scene, in));
  if (!in.at_end()) refuse("it is too long");
  const auto is_late = [&moment](const models::UserInput& i) { return i.step < moment.step; };
  if (!std::ranges::is_sorted(moment.given, models::acts_before) ||
      std::ranges::any_of(moment.given, is_late))
    refuse("its inputs are in no order");
}

}  // namespace soda
