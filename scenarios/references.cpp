#include "scenarios/references.hpp"

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

#include "scenarios/orientation.hpp"
#include "scenarios/read_json.hpp"
#include "scenarios/reference_tables.hpp"

namespace soda::scenarios {
namespace {

// The body with this label, or a fault at `member`.
const physics::BodyParams* body_of(std::int64_t label, const JsonValue& member,
                                   const Scenario& scenario, FaultList& faults) {
  const auto& bodies = scenario.scene.bodies;
  const auto at = std::lower_bound(
      bodies.begin(), bodies.end(), label,
      [](const physics::BodyParams& body, std::int64_t wanted) { return body.label < wanted; });
  if (at != bodies.end() && at->label == label) return &*at;
  add_fault(faults, member, {describe(member), "the id of a body of the scene", ""});
  return nullptr;
}

// Closed forms of rolling and bouncing are about spheres.
template <class Answer>
constexpr bool kWantsSpheres =
    std::is_same_v<Answer, Rolling> || std::is_same_v<Answer, Bouncing> ||
    std::is_same_v<Answer, TwoSpheres> || std::is_same_v<Answer, FloorImpact>;

template <class Answer>
void check_body(std::int64_t label, std::string_view key, const ReferenceBase& spec,
                const Scenario& scenario, FaultList& faults) {
  const JsonValue& member = *find_member(*spec.json, key);
  const physics::BodyParams* body = body_of(label, member, scenario, faults);
  if (body == nullptr) return;
  const physics::Shape& shape = scenario.scene.shapes[body->shape];
  if (kWantsSpheres<Answer> && !std::holds_alternative<physics::Sphere>(shape))
    add_fault(faults, member, {"a body that is no sphere", "the id of a sphere", ""});
}

// The kinds of joint with the world that an answer is about; none if it is about no joint.
template <class Answer>
constexpr std::array<std::optional<physics::JointKind>, 2> kWantsJoint{};
template <>
constexpr std::array<std::optional<physics::JointKind>, 2> kWantsJoint<DampedOscillator>{
    physics::JointKind::kSpring};
template <>
constexpr std::array<std::optional<physics::JointKind>, 2> kWantsJoint<SteadyPrecession>{
    physics::JointKind::kBall};
template <>
constexpr std::array<std::optional<physics::JointKind>, 2> kWantsJoint<JointTravel>{
    physics::JointKind::kHinge, physics::JointKind::kSlider};

template <class Answer>
void check_joint(std::int64_t label, const ReferenceBase& spec, const Scenario& scenario,
                 FaultList& faults) {
  const physics::Joint* joint = joint_with_world(scenario.scene, label);
  const auto& kinds = kWantsJoint<Answer>;
  if (joint != nullptr && std::ranges::find(kinds, joint->kind) != kinds.end()) return;
  add_fault(faults, *find_member(*spec.json, "body"),
            {"a body without the joint that this is about",
             "a body whose one joint is with the world, of the right kind", ""});
}

// Checks a spec against the scene and takes the answer out of it.
struct TakeAnswer {
  const Scenario& scenario;
  FaultList& faults;

  template <class Answer>
  KnownAnswer operator()(const AnswerSpec<Answer>& spec) const {
    if constexpr (requires { spec.body; })
      check_body<Answer>(spec.body, "body", spec, scenario, faults);
    if constexpr (kWantsJoint<Answer>[0].has_value())
      check_joint<Answer>(spec.body, spec, scenario, faults);
    if constexpr (std::is_same_v<Answer, DampedOscillator>) check_swing(spec);
    if constexpr (std::is_same_v<Answer, Rolling>) check_rolling(spec);
    if constexpr (requires { spec.other; })
      check_body<Answer>(spec.other, "other", spec, scenario, faults);
    if constexpr (std::is_same_v<Answer, SlidingRow>) {
      for (const physics::BodyParams& body : scenario.scene.bodies) {
        if (std::holds_alternative<physics::Box>(scenario.scene.shapes[body.shape])) continue;
        add_fault(faults, *find_member(*spec.json, "type"),
                  {"a scene whose body " + std::to_string(body.label) + " is no box",
                   "boxes and nothing else", ""});
        break;
      }
    }
    if constexpr (std::is_same_v<Answer, OneSide>) {
      if (spec.normal == Vec3::Zero())
        add_fault(faults, *find_member(*spec.json, "normal"),
                  {"a normal of length 0", "any length but zero", ""});
    }
    return static_cast<const Answer&>(spec);
  }
  // The form with rolling friction begins with rolling, and knows no slip.
  void check_rolling(const AnswerSpec<Rolling>& spec) const {
    constexpr double kRounding = 1e-9;
    const auto& bodies = scenario.scene.bodies;
    const auto at = std::ranges::find(bodies, spec.body, &physics::BodyParams::label);
    if (!(spec.rolling_friction_m > 0.0) || at == bodies.end()) return;
    const auto* const sphere = std::get_if<physics::Sphere>(&scenario.scene.shapes[at->shape]);
    if (sphere == nullptr) return;
    const physics::BodyState& start =
        scenario.initial[static_cast<std::size_t>(at - bodies.begin())];
    const double speed = start.linear_velocity_m_s.norm();
    const double rim = start.angular_velocity_rad_s.norm() * sphere->radius_m;
    if (std::abs(speed - rim) <= kRounding * speed) return;
    add_fault(
        faults, *find_member(*spec.json, "rolling_friction_m"),
        {"rolling friction of a sphere that slides at first", "one that rolls, or is at rest", ""});
  }
  // The form with friction goes from end to end of swings.
  void check_swing(const AnswerSpec<DampedOscillator>& spec) const {
    const physics::Joint* const spring = joint_with_world(scenario.scene, spec.body);
    if (!(spec.friction > 0.0) || spring == nullptr) return;
    const double mass = scenario.scene.bodies[physics::index_of(spring->a)].mass_kg;
    const double damping = spring->damping_newton_s_m;
    if (damping * damping < 4.0 * spring->stiffness_newton_m * mass) return;
    add_fault(faults, *find_member(*spec.json, "friction"),
              {"friction and a spring too damped to swing", "less damping, or no friction", ""});
  }
  KnownAnswer operator()(const StoredRunSpec& spec) const {
    StoredRun run;
    run.error_m = spec.error_m;
    for (const StoredEndSpec& end : spec.ends) {
      body_of(end.body, *find_member(*end.json, "body"), scenario, faults);
      run.ends.push_back({end.body, end.position_m, orientation_of(end.orientation, faults)});
    }
    return run;
  }
};

std::vector<Bound> bounds_of(const ReferenceBase& base) {
  std::vector<Bound> bounds;
  for (const MeasureKey& measure : measure_keys()) {
    const std::optional<double> must = base.must.*measure.bound;
    const std::optional<double> stretch = base.stretch.*measure.bound;
    if (must || stretch) bounds.push_back({std::string(measure.key), must, stretch});
  }
  return bounds;
}

}  // namespace

const physics::Joint* joint_with_world(const physics::SceneDescription& scene, std::int64_t label) {
  for (const physics::Joint& joint : scene.joints) {
    const physics::BodyParams& body = scene.bodies[physics::index_of(joint.a)];
    if (body.label == label && body.joints == 1 && joint.b == physics::kWorldBody) return &joint;
  }
  return nullptr;
}

std::vector<Reference> build_references(const std::vector<ReferenceSpec>& specs,
                                        const Scenario& scenario, FaultList& faults) {
  std::vector<Reference> references;
  for (const ReferenceSpec& spec : specs) {
    const auto& base = std::visit([](const auto& s) -> const ReferenceBase& { return s; }, spec);
    if (!base.sound) continue;
    references.push_back({std::string(kReference.entries[spec.index()].name),
                          std::visit(TakeAnswer{scenario, faults}, spec), bounds_of(base)});
  }
  return references;
}

}  // namespace soda::scenarios
