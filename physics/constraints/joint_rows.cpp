#include "physics/constraints/joint_rows.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "physics/constraints/joint_anchor.hpp"
#include "physics/constraints/sweep_order.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/model/body_places.hpp"
#include "physics/model/kinematic.hpp"

namespace soda::physics {
namespace {

// One body's end of a joint, in the world frame.
struct HeldEnd {
  std::uint32_t body = 0;
  Vec3 arm = Vec3::Zero();  // from the centre to the anchor
  Vec3 anchor = Vec3::Zero();
  Quat frame = Quat::Identity();
};

// `with_frame`: else the frame is not asked for.
HeldEnd end_of(std::span<const BodyState> states, std::uint32_t body, const Vec3& anchor_local,
               const Quat& frame_local, bool with_frame) {
  const JointAnchor anchor = anchor_of(states, body, anchor_local);
  HeldEnd end{body, anchor.arm, anchor.place_m, frame_local};
  if (body == states.size()) return end;
  end.frame = with_frame ? states[body].orientation * frame_local : Quat::Identity();
  return end;
}

struct HeldEnds {
  HeldEnd a, b;
};

HeldEnds ends_of(const Joint& joint, const std::array<std::uint32_t, 2>& bodies,
                 std::span<const BodyState> states) {
  const bool with_frame = joint.kind == JointKind::kHinge || joint.kind == JointKind::kSlider ||
                          joint.kind == JointKind::kFixed;
  return {end_of(states, bodies[0], joint.anchor_a_m, joint.frame_a, with_frame),
          end_of(states, bodies[1], joint.anchor_b_m, joint.frame_b, with_frame)};
}

// Appends the rows of a joint.
class RowBuilder {
 public:
  RowBuilder(const HeldEnds& ends, double lever_m, std::vector<JointRow>& rows)
      : a_(ends.a), b_(ends.b), lever_m_(lever_m), rows_(rows) {}

  // The anchors have the same place along `direction`.
  JointRow& point(const Vec3& direction) {
    JointRow& row = add();
    row.linear = direction;
    row.angular_a = a_.arm.cross(direction);
    row.angular_b = b_.arm.cross(direction);
    row.error = direction.dot(b_.anchor - a_.anchor);
    return row;
  }
  // The same for a direction that is fixed in a.
  JointRow& along_a(const Vec3& direction) {
    JointRow& row = point(direction);
    row.angular_a = (a_.arm + b_.anchor - a_.anchor).cross(direction);
    return row;
  }
  // No rotation about `axis`.
  JointRow& rotation(const Vec3& axis, double angle_rad) {
    JointRow& row = add();
    row.angular_a = row.angular_b = lever_m_ * axis;
    row.error = lever_m_ * angle_rad;
    row.lever_m = lever_m_;
    return row;
  }

 private:
  JointRow& add() {
    rows_.emplace_back();
    rows_.back().a = a_.body;
    rows_.back().b = b_.body;
    return rows_.back();
  }

  const HeldEnd& a_;
  const HeldEnd& b_;
  double lever_m_;
  std::vector<JointRow>& rows_;
};

// Goes over the rows of a joint that there are, one after the other, and writes errors only.
class ErrorBuilder {
 public:
  ErrorBuilder(const HeldEnds& ends, double lever_m, JointRow* first)
      : between_m_(ends.b.anchor - ends.a.anchor), lever_m_(lever_m), row_(first) {}

  JointRow& point(const Vec3& direction) { return next(direction.dot(between_m_)); }
  JointRow& along_a(const Vec3& direction) { return point(direction); }
  JointRow& rotation(const Vec3&, double angle_rad) { return next(lever_m_ * angle_rad); }

 private:
  JointRow& next(double error) {
    row_->error = error;
    return *row_++;
  }

  Vec3 between_m_;
  double lever_m_;
  JointRow* row_;
};

template <class Builder>
void add_distance(const Joint& joint, double dt_s, bool with_springs, const HeldEnds& ends,
                  Builder& add) {
  const Vec3 between = ends.b.anchor - ends.a.anchor;
  const double distance = between.norm();
  const Vec3 direction = distance > 0.0 ? Vec3(between / distance) : Vec3(Vec3::UnitZ());
  JointRow& row = add.point(direction);
  row.error = distance - joint.length_m;
  if (joint.kind != JointKind::kSpring) return;
  if (!with_springs) {
    row.linear = row.angular_a = row.angular_b = Vec3::Zero();
    row.error = 0.0;
    return;
  }
  // Implicit in position and velocity: stable however stiff.
  const double damping = joint.damping_newton_s_m + dt_s * joint.stiffness_newton_m;
  row.kind = JointRowKind::kSpring;
  row.softness_1_kg = 1.0 / (dt_s * damping);
  row.stiffness_share_1_s = joint.stiffness_newton_m / damping;
  row.target_m_s = -row.error * row.stiffness_share_1_s;
}

// By how much b's frame is turned against a's about their common z axis, rad in [-pi, pi].
double turned_about_z(const Quat& a, const Quat& b) {
  const Quat difference = a.conjugate() * b;
  const double sign = difference.w() < 0.0 ? -1.0 : 1.0;
  const double sine = sign * difference.z(), cosine = sign * difference.w();
  const double length = std::sqrt(sine * sine + cosine * cosine);
  if (!(length > 0.0)) return 0.0;
  // The tangent of a quarter of the angle, halved three times more: there its series is short.
  double tangent = sine / (length + cosine);
  for (int i = 0; i < 3; ++i) tangent /= 1.0 + std::sqrt(1.0 + tangent * tangent);
  const double squared = tangent * tangent;
  double series = 0.0;
  for (int k = 19; k >= 1; k -= 2) series = 1.0 / k - squared * series;
  return 32.0 * tangent * series;
}

// The rows of a limit and a motor along the joint's axis.
template <class Builder>
void add_bounded(const Joint& joint, const Vec3& axis, const HeldEnds& ends, Builder& add) {
  const auto& [a, b] = ends;
  const bool turns = joint.kind == JointKind::kHinge;
  const double place =
      turns ? turned_about_z(a.frame, b.frame) : axis.dot(Vec3(b.anchor - a.anchor));
  const auto row = [&](JointRowKind kind, double sign, double left) -> JointRow& {
    JointRow& made = turns ? add.rotation(axis * sign, left) : add.along_a(axis * sign);
    if (!turns) made.error = left;
    made.kind = kind;
    made.idle = true;
    return made;
  };
  if (joint.limits) {
    row(JointRowKind::kLimit, 1.0, place - joint.limits->least);
    row(JointRowKind::kLimit, -1.0, joint.limits->most - place);
  }
  if (!joint.motor) return;
  JointRow& motor = row(JointRowKind::kMotor, 1.0, 0.0);
  motor.motor = &*joint.motor;
  motor.left = joint.motor->target.value_or(place) - place;
}

template <class Builder>
void add_rows(const Joint& joint, double dt_s, bool with_springs, const HeldEnds& ends,
              Builder& add) {
  if (joint.kind == JointKind::kDistance || joint.kind == JointKind::kSpring)
    return add_distance(joint, dt_s, with_springs, ends, add);
  if (joint.kind == JointKind::kBall) {
    for (int i = 0; i < 3; ++i) add.point(Vec3::Unit(i));
    return;
  }
  const auto& [a, b] = ends;
  const Mat3 axes = a.frame.toRotationMatrix();
  if (joint.kind == JointKind::kSlider) {
    add.along_a(axes.col(0));
    add.along_a(axes.col(1));
  } else {
    for (int i = 0; i < 3; ++i) add.point(Vec3::Unit(i));
  }
  if (joint.kind == JointKind::kHinge) {
    const Vec3 tilt = Vec3(axes.col(2)).cross(b.frame * Vec3(Vec3::UnitZ()));
    for (int i = 0; i < 2; ++i) add.rotation(axes.col(i), tilt.dot(axes.col(i)));
  } else {
    const Vec3 rotation = small_rotation(a.frame, b.frame);
    for (int i = 0; i < 3; ++i) add.rotation(Vec3::Unit(i), rotation[i]);
  }
  if (joint.limits || joint.motor) add_bounded(joint, axes.col(2), ends, add);
}

std::uint32_t row_count(const Joint& joint) {
  const std::uint32_t bounded = (joint.limits ? 2 : 0) + (joint.motor ? 1 : 0);
  switch (joint.kind) {
    case JointKind::kBall:
      return 3;
    case JointKind::kHinge:
    case JointKind::kSlider:
      return 5 + bounded;
    case JointKind::kFixed:
      return 6 + bounded;
    case JointKind::kDistance:
    case JointKind::kSpring:
      break;
  }
  return 1;
}

JointEnds moved_ends(const SceneDescription& scene, const Joint& joint, JointEnds bodies) {
  if (is_kinematic(scene, joint.a)) bodies[0] = kImmovable;
  if (is_static(joint.b) || is_kinematic(scene, joint.b)) bodies[1] = kImmovable;
  return bodies;
}

void find_first_rows(const SceneDescription& scene, JointSystem& system) {
  system.first_row.reserve(system.joints.size() + 1);
  system.first_row.push_back(0);
  for (const std::uint32_t joint : system.joints)
    system.first_row.push_back(system.first_row.back() + row_count(scene.joints[joint]));
}

}  // namespace

// Without response everything passes through, joints or not (advance_island.cpp).
Need joint_rows_needed(const SceneDescription& scene) {
  if (scene.joints.empty()) return {false, "there are no joints"};
  return need_of(scene.solver.contact_response, "joints hold bodies",
                 "detection only: joints hold nothing");
}

Need limits_needed(const SceneDescription& scene) {
  const Need joints = joint_rows_needed(scene);
  if (!joints) return joints;
  return need_of(std::ranges::any_of(scene.joints, [](const Joint& j) { return !!j.limits; }),
                 "a joint has limits", "no joint has limits");
}

Need motors_needed(const SceneDescription& scene) {
  const Need joints = joint_rows_needed(scene);
  if (!joints) return joints;
  return need_of(std::ranges::any_of(scene.joints, [](const Joint& j) { return !!j.motor; }),
                 "a joint has a motor", "no joint has a motor");
}

namespace {

// Of what it can move: radii of gyration, and anchors from centres.
double reach_m(const SceneDescription& scene, const Joint& joint, const JointEnds& ends) {
  const auto of_body = [&scene](BodyId id, const Vec3& anchor_m) {
    const BodyParams& body = scene.bodies[index_of(id)];
    return std::max(std::sqrt(0.5 * body.inertia_local_kg_m2.trace() / body.mass_kg),
                    anchor_m.norm());
  };
  double most = 0.0;
  if (ends[0] != kImmovable) most = std::max(most, of_body(joint.a, joint.anchor_a_m));
  if (ends[1] != kImmovable) most = std::max(most, of_body(joint.b, joint.anchor_b_m));
  return most;
}

// From the first body to the farthest.
double extent_m(std::span<const BodyState> states) {
  double squared = 0.0;
  for (const BodyState& state : states)
    squared = std::max(squared, (state.position_m - states.front().position_m).squaredNorm());
  return std::sqrt(squared);
}

}  // namespace

JointSystem find_joints(const SceneDescription& scene, std::span<const BodyId> ids,
                        std::span<const ContactManifold> manifolds) {
  JointSystem system;
  if (scene.joints.empty()) return system;
  std::vector<std::uint32_t> joints;
  for (const ContactManifold& manifold : manifolds)
    if (is_joint(manifold)) joints.push_back(joint_of(manifold));
  std::vector<std::array<std::uint32_t, 2>> bodies;
  for (const std::uint32_t joint : joints)
    bodies.push_back({place_of(ids, scene.joints[joint].a), place_of(ids, scene.joints[joint].b)});
  const std::vector<std::uint32_t> order =
      sweep_order(static_cast<std::uint32_t>(ids.size()), bodies);
  for (std::uint32_t i = 0; i < order.size(); ++i) {
    const std::uint32_t number = joints[order[i]];
    const Joint& joint = scene.joints[number];
    system.joints.push_back(number);
    system.bodies.push_back(bodies[order[i]]);
    system.ends.push_back(moved_ends(scene, joint, system.bodies.back()));
    system.reach_m = std::max(system.reach_m, reach_m(scene, joint, system.ends.back()));
    system.bounded = system.bounded || joint.limits || joint.motor;
    if (can_break(joint)) system.breakable.push_back(i);
  }
  find_first_rows(scene, system);
  return system;
}

bool has_springs(const SceneDescription& scene, const JointSystem& system) {
  return std::ranges::any_of(system.joints, [&scene](std::uint32_t joint) {
    return scene.joints[joint].kind == JointKind::kSpring;
  });
}

void build_joint_rows(const SceneDescription& scene, double dt_s, std::span<const BodyState> states,
                      bool with_springs, JointSystem& system) {
  if (!(system.lever_m > 0.0)) system.lever_m = std::max(system.reach_m, extent_m(states));
  system.rows.clear();
  system.rows.reserve(3 * system.joints.size());  // balls, mostly
  system.factored = false;
  system.first_row.clear();
  system.first_row.reserve(system.joints.size() + 1);
  system.first_row.push_back(0);
  for (std::size_t j = 0; j < system.joints.size(); ++j) {
    const Joint& joint = scene.joints[system.joints[j]];
    const HeldEnds ends = ends_of(joint, system.bodies[j], states);
    RowBuilder add(ends, system.lever_m, system.rows);
    add_rows(joint, dt_s, with_springs, ends, add);
    system.first_row.push_back(static_cast<std::uint32_t>(system.rows.size()));
  }
}

void build_joint_errors(const SceneDescription& scene, std::span<const BodyState> states,
                        JointSystem& system) {
  for (std::size_t j = 0; j < system.joints.size(); ++j) {
    const Joint& joint = scene.joints[system.joints[j]];
    const HeldEnds ends = ends_of(joint, system.bodies[j], states);
    ErrorBuilder add(ends, system.lever_m, &system.rows[system.first_row[j]]);
    add_rows(joint, 0.0, false, ends, add);
  }
}

std::vector<SpringRow> spring_rows(const SceneDescription& scene, std::span<const BodyState> states,
                                   const JointSystem& system) {
  std::vector<SpringRow> springs;
  std::vector<JointRow> rows;
  for (std::size_t j = 0; j < system.joints.size(); ++j) {
    const Joint& joint = scene.joints[system.joints[j]];
    if (joint.kind != JointKind::kSpring) continue;
    const HeldEnds ends = ends_of(joint, system.bodies[j], states);
    rows.clear();
    RowBuilder add(ends, system.lever_m, rows);
    add_rows(joint, scene.dt_s, true, ends, add);
    springs.push_back({rows.front(),
                       joint.stiffness_newton_m,
                       joint.damping_newton_s_m,
                       Vec3(ends.b.anchor - ends.a.anchor).norm(),
                       {ends.a.arm.norm(), ends.b.arm.norm()},
                       system.joints[j],
                       can_break(joint)});
  }
  return springs;
}

}  // namespace soda::physics
