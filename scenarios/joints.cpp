#include "scenarios/joints.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "physics/math/rigid_motion.hpp"
#include "physics/model/kinematic.hpp"
#include "physics/shapes/mass_properties.hpp"
#include "scenarios/cross_checks.hpp"
#include "scenarios/json_tree.hpp"

namespace soda::scenarios {
namespace {

using physics::Joint;
using physics::JointKind;

const JointBase& base_of(const JointSpec& spec) {
  return std::visit([](const auto& s) -> const JointBase& { return s; }, spec);
}

double size_m(const Scenario& scenario, physics::BodyId id) {
  const std::uint32_t shape = scenario.scene.bodies[physics::index_of(id)].shape;
  return std::cbrt(
      physics::mass_properties(scenario.scene.shapes[shape], scenario.scene.shapes).volume_m3);
}

constexpr double kNoLimit = 1e9;

// What draws two bodies apart, of the one that has the most of it.
struct Pull {
  double mass_kg = 0.0, speed_m_s = 0.0, field_m_s2 = 0.0;

  void add(const physics::SceneDescription& scene, physics::BodyId id,
           const physics::BodyState& state) {
    const physics::BodyParams& body = scene.bodies[physics::index_of(id)];
    mass_kg = std::max(mass_kg, body.mass_kg);
    speed_m_s = std::max(speed_m_s, state.linear_velocity_m_s.norm());
    field_m_s2 = std::max(field_m_s2, physics::field_of(scene, body).norm());
  }
  // How far a spring swings out under it, but for what it cannot go within a time.
  double stretch_m(double stiffness_newton_m, double time_s) const {
    const double squared = mass_kg / stiffness_newton_m;
    const double swing = 2.0 * field_m_s2 * squared + speed_m_s * std::sqrt(squared);
    return std::min(swing, (speed_m_s + 0.5 * field_m_s2 * time_s) * time_s);
  }
};

struct MotorValues {
  std::optional<double> speed, push, target, time_constant_s;
};

bool points_down(const Vec3& axis) { return axis.z() < 0.0; }

// Whether the axis of the joint is the opposite of that in the file.
bool is_flipped(const JointSpec& spec) {
  if (const auto* hinge = std::get_if<HingeSpec>(&spec)) return points_down(hinge->axis);
  if (const auto* slider = std::get_if<SliderSpec>(&spec)) return points_down(slider->axis);
  return false;
}

// What is special to a kind; anchors and axes are still in the world frame.
struct FillJoint {
  Joint& joint;
  double size_m;  // of the smaller body
  Pull pull;
  double run_s;
  FaultList& faults;

  void operator()(const BallSpec&) const { joint.kind = JointKind::kBall; }
  void operator()(const FixedSpec&) const { joint.kind = JointKind::kFixed; }
  void operator()(const HingeSpec& spec) const {
    joint.kind = JointKind::kHinge;
    const bool flipped = turn(spec, spec.axis);
    bound(spec, spec.min_angle_rad, spec.max_angle_rad, 3.0, flipped);
    drive(spec,
          {spec.motor_speed_rad_s, spec.motor_torque_newton_m, spec.motor_target_rad,
           spec.motor_time_constant_s},
          kHingeMotor, flipped);
  }
  void operator()(const SliderSpec& spec) const {
    joint.kind = JointKind::kSlider;
    joint.reach_m = std::max(4.0 * size_m, std::abs(spec.motor_speed_m_s.value_or(0.0)) * run_s);
    const bool flipped = turn(spec, spec.axis);
    if (spec.min_way_m && spec.max_way_m)
      joint.reach_m = 2.0 * size_m + std::max(-*spec.min_way_m, *spec.max_way_m);
    bound(spec, spec.min_way_m, spec.max_way_m, kNoLimit, flipped);
    drive(spec,
          {spec.motor_speed_m_s, spec.motor_force_newton, spec.motor_target_m,
           spec.motor_time_constant_s},
          kSliderMotor, flipped);
  }
  void operator()(const DistanceSpec& spec) const {
    joint.kind = JointKind::kDistance;
    stretch(spec, spec.other_anchor_m, spec.length_m);
    if (!(joint.length_m > 0.0))
      add_fault(faults, *spec.json, {"a distance of 0 m", "a distance above 0 (or a ball)", ""});
    const double apart_m = (spec.other_anchor_m - spec.anchor_m).norm();
    constexpr double kRounded = 1e-6;  // what digits left out of a file may come to
    if (spec.length_m && std::abs(*spec.length_m - apart_m) > kRounded * apart_m)
      add_fault(faults, *find_member(*spec.json, "length_m"),
                {number_text(*spec.length_m) + " m between anchors that are " +
                     number_text(apart_m) + " m apart",
                 "the distance that they have at the start, or no length_m", ""});
  }
  void operator()(const SpringSpec& spec) const {
    joint.kind = JointKind::kSpring;
    stretch(spec, spec.other_anchor_m, spec.length_m);
    joint.stiffness_newton_m = spec.stiffness_newton_m;
    joint.damping_newton_s_m = spec.damping_newton_s_m;
    joint.reach_m =
        joint.length_m + std::max(4.0 * size_m, pull.stretch_m(spec.stiffness_newton_m, run_s));
  }

 private:
  // Limits and motors are the body's against the other one, about an axis that may have been
  // flipped; those of a joint are b's against a. The body is a, until the two are exchanged.
  void bound(const JointBase&, std::optional<double> least, std::optional<double> most, double none,
             bool flipped) const {
    if (!least && !most) return;
    const double low = least.value_or(-none), high = most.value_or(none);
    joint.limits = flipped ? physics::JointLimits{low, high} : physics::JointLimits{-high, -low};
  }
  // After bound().
  void drive(const JointBase& spec, const MotorValues& given, const MotorKeys& keys,
             bool flipped) const {
    const auto fault = [&](const char* there, const std::string& found, std::string allowed) {
      add_fault(faults, *find_member(*spec.json, there), {found, std::move(allowed), ""});
    };
    if (given.speed.has_value() != given.push.has_value()) {
      const char* const there = given.speed ? keys.speed : keys.push;
      const char* const missing = given.speed ? keys.push : keys.speed;
      return fault(there, std::string(there) + " without " + missing,
                   "both " + std::string(keys.speed) + " and " + keys.push + ", or neither");
    }
    if (given.target && !given.speed)
      return fault(keys.target, std::string(keys.target) + " without a motor",
                   "a target beside " + std::string(keys.speed) + " and " + keys.push);
    if (given.time_constant_s && !given.target)
      return fault("motor_time_constant_s", "motor_time_constant_s without a target",
                   "a time constant beside " + std::string(keys.target));
    if (!given.speed) return;
    const double sign = flipped ? 1.0 : -1.0;
    joint.motor = physics::JointMotor{sign * *given.speed, *given.push, std::nullopt};
    if (!given.target) return;
    joint.motor->target = sign * *given.target;
    if (given.time_constant_s) joint.motor->time_constant_s = *given.time_constant_s;
    if (!are_within_limits(joint, *joint.motor->target))
      fault(keys.target,
            number_text(*given.target) + ", which the joint's limits do not let it reach",
            "a target within the limits");
  }
  // Whether the axis is flipped.
  bool turn(const JointBase& spec, const Vec3& axis) const {
    const double norm = axis.norm();
    if (norm < 1e-6) {
      add_fault(faults, *find_member(*spec.json, "axis"),
                {"an axis of length " + number_text(norm), "an axis of length at least 1e-6", ""});
      return false;
    }
    // Either end of an axis will do. That of the upper half keeps away from opposite vectors, near
    // which rounding says what the shortest turn is.
    const Vec3 up = points_down(axis) ? Vec3(-axis / norm) : Vec3(axis / norm);
    joint.frame_a = joint.frame_b = physics::turn_between(Vec3::UnitZ(), up);
    return points_down(axis);
  }
  void stretch(const JointBase& spec, const Vec3& other, std::optional<double> length_m) const {
    joint.anchor_b_m = other;
    joint.length_m = length_m.value_or((other - spec.anchor_m).norm());
    joint.reach_m = joint.length_m + 4.0 * size_m;
  }
};

// From the world frame, at the start, into the body's.
void localise(const Scenario& scenario, physics::BodyId id, Vec3& anchor, physics::Quat& frame) {
  if (physics::is_static(id)) return;
  const physics::BodyState& state = scenario.initial[physics::index_of(id)];
  const physics::Quat back = state.orientation.conjugate();
  anchor = back * (anchor - state.position_m);
  frame = back * frame;
}

double most_torque_newton_m(const JointSpec& spec) {
  static constexpr double kNever = std::numeric_limits<double>::infinity();
  return std::visit(
      [](const auto& s) {
        if constexpr (requires { s.break_torque_newton_m; })
          return s.break_torque_newton_m.value_or(kNever);
        else
          return kNever;
      },
      spec);
}

class Builder {
 public:
  Builder(Scenario& scenario, FaultList& faults) : scenario_(scenario), faults_(faults) {}

  void build(const JointSpec& spec) {
    const JointBase& base = base_of(spec);
    if (!base.sound || !is_new(base)) return;
    const auto a = body(base, "body", base.body);
    const auto b = base.other_body ? body(base, "other_body", *base.other_body)
                                   : std::optional(physics::kWorldBody);
    if (!a || !b) return;
    if (is_kinematic(*a) || is_kinematic(*b))
      return add_fault(faults_, *find_member(*base.json, is_kinematic(*a) ? "body" : "other_body"),
                       {"a joint of a kinematic body", "bodies that have a mass", ""});
    if (*a == *b)
      return add_fault(faults_, *find_member(*base.json, "other_body"),
                       {"a joint of a body with itself", "another body", ""});
    Joint joint;
    joint.label = static_cast<std::uint32_t>(base.id);
    joint.a = *a;
    joint.b = *b;
    joint.collides = base.can_collide;
    joint.most_force_newton = base.break_force_newton.value_or(joint.most_force_newton);
    joint.most_torque_newton_m = most_torque_newton_m(spec);
    joint.anchor_a_m = joint.anchor_b_m = base.anchor_m;
    double size = size_m(scenario_, *a);
    if (!physics::is_static(*b)) size = std::min(size, size_m(scenario_, *b));
    joint.reach_m = 0.25 * size;
    const double run_s = scenario_.run.steps * scenario_.scene.dt_s;
    std::visit(FillJoint{joint, size, pull_of(*a, *b), run_s, faults_}, spec);
    double sign = is_flipped(spec) ? 1.0 : -1.0;
    joint.reach_m = base.reach_m.value_or(joint.reach_m);
    localise(scenario_, joint.a, joint.anchor_a_m, joint.frame_a);
    localise(scenario_, joint.b, joint.anchor_b_m, joint.frame_b);
    if (joint.b < joint.a) {
      std::swap(joint.a, joint.b);
      std::swap(joint.anchor_a_m, joint.anchor_b_m);
      std::swap(joint.frame_a, joint.frame_b);
      if (joint.limits) joint.limits = {-joint.limits->most, -joint.limits->least};
      if (joint.motor) joint.motor->speed = -joint.motor->speed;
      if (joint.motor && joint.motor->target) joint.motor->target = -*joint.motor->target;
      sign = -sign;
    }
    if (joint.motor) scenario_.motor_signs[joint.label] = sign;
    scenario_.scene.joints.push_back(joint);
  }

 private:
  bool is_kinematic(physics::BodyId id) const {
    return id != physics::kWorldBody && physics::is_kinematic(scenario_.scene, id);
  }
  Pull pull_of(physics::BodyId a, physics::BodyId b) const {
    Pull pull;
    for (const physics::BodyId id : {a, b})
      if (!physics::is_static(id))
        pull.add(scenario_.scene, id, scenario_.initial[physics::index_of(id)]);
    return pull;
  }
  bool is_new(const JointBase& base) {
    const JsonValue& member = *find_member(*base.json, "id");
    const auto [first, is_new] = ids_.try_emplace(base.id, place_of(member));
    if (!is_new)
      add_fault(faults_, member,
                {describe(member) + " again", "ids that no other joint has",
                 "first at " + first->second});
    return is_new;
  }

  std::optional<physics::BodyId> body(const JointBase& base, const char* key,
                                      std::int64_t label) const {
    const JsonValue& member = *find_member(*base.json, key);
    const std::optional<std::uint32_t> place = find_body(scenario_.scene, label);
    if (!place) {
      add_fault(faults_, member,
                {describe(member) + ", which no body has", "the id of a body of the scene", ""});
      return std::nullopt;
    }
    const physics::BodyId id{*place};
    const auto& absent = scenario_.run.inputs.absent;
    if (std::ranges::find(absent, id) != absent.end()) {
      add_fault(faults_, member,
                {describe(member) + ", a body that is not there yet",
                 "a body without \"present\": false", ""});
      return std::nullopt;
    }
    return id;
  }

  Scenario& scenario_;
  FaultList& faults_;
  std::map<std::int64_t, std::string> ids_;
};

}  // namespace

bool are_within_limits(const physics::Joint& joint, double place) {
  return !joint.limits || (place >= joint.limits->least && place <= joint.limits->most);
}

void build_joints(const std::vector<JointSpec>& joints, Scenario& scenario, FaultList& faults) {
  if (!joints.empty() && !scenario.scene.solver.contact_response)
    add_fault(faults, *base_of(joints.front()).json,
              {"a joint where contact_response is false", "joints where bodies respond", ""});
  Builder builder(scenario, faults);
  for (const JointSpec& spec : joints) builder.build(spec);
  physics::order_joints(scenario.scene);
}

}  // namespace soda::scenarios
