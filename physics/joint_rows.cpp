#include "physics/joint_rows.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace soda::physics {
namespace {

std::uint32_t place_of(std::span<const BodyId> ids, BodyId id) {
  if (is_static(id)) return static_cast<std::uint32_t>(ids.size());
  return static_cast<std::uint32_t>(std::lower_bound(ids.begin(), ids.end(), id) - ids.begin());
}

// For each joint, those that share a dynamic body with it; ascending.
std::vector<std::vector<std::uint32_t>> neighbours_of(const SceneDescription& scene,
                                                      std::span<const BodyId> ids,
                                                      std::span<const std::uint32_t> joints) {
  std::vector<std::vector<std::uint32_t>> of_body(ids.size() + 1), neighbours(joints.size());
  const auto bodies = [&](std::uint32_t joint) {
    return std::array{place_of(ids, scene.joints[joints[joint]].a),
                      place_of(ids, scene.joints[joints[joint]].b)};
  };
  for (std::uint32_t joint = 0; joint < joints.size(); ++joint)
    for (const std::uint32_t body : bodies(joint)) of_body[body].push_back(joint);
  of_body.back().clear();
  for (std::uint32_t joint = 0; joint < joints.size(); ++joint) {
    for (const std::uint32_t body : bodies(joint))
      for (const std::uint32_t other : of_body[body])
        if (other != joint) neighbours[joint].push_back(other);
    std::sort(neighbours[joint].begin(), neighbours[joint].end());
    neighbours[joint].erase(std::unique(neighbours[joint].begin(), neighbours[joint].end()),
                            neighbours[joint].end());
  }
  return neighbours;
}

// Reverse Cuthill-McKee: breadth first from the joint with the fewest neighbours. Chains and trees
// get an envelope as narrow as their branches.
std::vector<std::uint32_t> elimination_order(
    const std::vector<std::vector<std::uint32_t>>& neighbours) {
  const auto fewer = [&neighbours](std::uint32_t x, std::uint32_t y) {
    return std::pair(neighbours[x].size(), x) < std::pair(neighbours[y].size(), y);
  };
  std::vector<std::uint32_t> starts(neighbours.size()), order;
  std::iota(starts.begin(), starts.end(), 0u);
  std::sort(starts.begin(), starts.end(), fewer);
  std::vector<bool> seen(neighbours.size(), false);
  for (const std::uint32_t start : starts) {
    if (seen[start]) continue;
    seen[start] = true;
    order.push_back(start);
    for (std::size_t next = order.size() - 1; next < order.size(); ++next) {
      std::vector<std::uint32_t> found;
      for (const std::uint32_t other : neighbours[order[next]])
        if (!seen[other]) found.push_back(other);
      std::sort(found.begin(), found.end(), fewer);
      for (const std::uint32_t other : found) seen[other] = true;
      order.insert(order.end(), found.begin(), found.end());
    }
  }
  std::reverse(order.begin(), order.end());
  return order;
}

// One body's end of a joint, in the world frame.
struct End {
  std::uint32_t body = 0;
  Vec3 arm = Vec3::Zero();  // from the centre to the anchor
  Vec3 anchor = Vec3::Zero();
  Quat frame = Quat::Identity();
};

End end_of(std::span<const BodyId> ids, std::span<const BodyState> states, BodyId id,
           const Vec3& anchor_local, const Quat& frame_local) {
  End end;
  end.body = place_of(ids, id);
  if (is_static(id)) {
    end.anchor = anchor_local;
    end.frame = frame_local;
    return end;
  }
  const BodyState& state = states[end.body];
  end.arm = state.orientation * anchor_local;
  end.anchor = state.position_m + end.arm;
  end.frame = state.orientation * frame_local;
  return end;
}

class RowBuilder {
 public:
  RowBuilder(const End& a, const End& b, std::vector<JointRow>& rows) : a_(a), b_(b), rows_(rows) {}

  // The anchors have the same place along `direction`.
  JointRow& point(const Vec3& direction) {
    JointRow& row = add();
    row.linear = direction;
    row.turn_a = a_.arm.cross(direction);
    row.turn_b = b_.arm.cross(direction);
    row.error = direction.dot(b_.anchor - a_.anchor);
    return row;
  }
  // The same for a direction that is fixed in a.
  void along_a(const Vec3& direction) {
    JointRow& row = point(direction);
    row.turn_a = (a_.arm + b_.anchor - a_.anchor).cross(direction);
  }
  // No turn about `axis`; `error` is the angle.
  void turn(const Vec3& axis, double error) {
    JointRow& row = add();
    row.turn_a = row.turn_b = axis;
    row.error = error;
  }

 private:
  JointRow& add() {
    rows_.emplace_back();
    rows_.back().a = a_.body;
    rows_.back().b = b_.body;
    return rows_.back();
  }

  const End& a_;
  const End& b_;
  std::vector<JointRow>& rows_;
};

// By how much b's frame is turned against a's, as a rotation vector (small angles: sin for it).
Vec3 turned_by(const Quat& a, const Quat& b) {
  const Quat difference = b * a.conjugate();
  const double sign = difference.w() < 0.0 ? -2.0 : 2.0;
  return sign * difference.vec();
}

void add_distance(const Joint& joint, double dt_s, bool with_springs, const End& a, const End& b,
                  RowBuilder& add) {
  const Vec3 between = b.anchor - a.anchor;
  const double distance = between.norm();
  const Vec3 direction = distance > 0.0 ? Vec3(between / distance) : Vec3(Vec3::UnitZ());
  JointRow& row = add.point(direction);
  row.error = distance - joint.length_m;
  if (joint.kind != JointKind::kSpring) return;
  if (!with_springs) {
    row.linear = row.turn_a = row.turn_b = Vec3::Zero();
    row.error = 0.0;
    return;
  }
  // Implicit in position and velocity: stable however stiff.
  const double damping = joint.damping_newton_s_m + dt_s * joint.stiffness_newton_m;
  row.softness_1_kg = 1.0 / (dt_s * damping);
  row.stiffness_share_1_s = joint.stiffness_newton_m / damping;
  row.target_m_s = -row.error * row.stiffness_share_1_s;
}

void add_rows(const Joint& joint, double dt_s, bool with_springs, const End& a, const End& b,
              std::vector<JointRow>& rows) {
  RowBuilder add(a, b, rows);
  if (joint.kind == JointKind::kDistance || joint.kind == JointKind::kSpring)
    return add_distance(joint, dt_s, with_springs, a, b, add);
  const Mat3 axes = a.frame.toRotationMatrix();
  if (joint.kind == JointKind::kSlider) {
    add.along_a(axes.col(0));
    add.along_a(axes.col(1));
  } else {
    for (int i = 0; i < 3; ++i) add.point(Vec3::Unit(i));
  }
  if (joint.kind == JointKind::kHinge) {
    const Vec3 tilt = Vec3(axes.col(2)).cross(b.frame * Vec3(Vec3::UnitZ()));
    for (int i = 0; i < 2; ++i) add.turn(axes.col(i), tilt.dot(axes.col(i)));
  } else if (joint.kind != JointKind::kBall) {
    const Vec3 turn = turned_by(a.frame, b.frame);
    for (int i = 0; i < 3; ++i) add.turn(Vec3::Unit(i), turn[i]);
  }
}

// What an impulse along `y` does to the velocity of `x`, by the one body.
double response(const JointRow& x, double sign_x, const Vec3& turn_x, const JointRow& y,
                double sign_y, const Vec3& turn_y, const SolverBody& body) {
  return sign_x * sign_y *
         (body.inverse_mass * x.linear.dot(y.linear) + turn_x.dot(body.inverse_inertia * turn_y));
}

double coupling(const JointRow& x, const JointRow& y, std::span<const SolverBody> bodies) {
  const auto world = static_cast<std::uint32_t>(bodies.size());
  double sum = 0.0;
  const auto end = [](const JointRow& row, bool is_b) {
    return std::pair(is_b ? row.b : row.a, is_b ? 1.0 : -1.0);
  };
  for (const bool x_is_b : {false, true}) {
    for (const bool y_is_b : {false, true}) {
      const auto [body_x, sign_x] = end(x, x_is_b);
      const auto [body_y, sign_y] = end(y, y_is_b);
      if (body_x != body_y || body_x >= world) continue;
      sum += response(x, sign_x, x_is_b ? x.turn_b : x.turn_a, y, sign_y,
                      y_is_b ? y.turn_b : y.turn_a, bodies[body_x]);
    }
  }
  return sum;
}

bool share_a_body(const JointRow& x, const JointRow& y, std::uint32_t world) {
  return (x.a == y.a || x.a == y.b) || (x.b != world && (x.b == y.a || x.b == y.b));
}

}  // namespace

JointSystem find_joints(const SceneDescription& scene, std::span<const BodyId> ids,
                        std::span<const ContactManifold> manifolds) {
  JointSystem system;
  if (scene.joints.empty()) return system;
  std::vector<std::uint32_t> joints;
  for (const ContactManifold& manifold : manifolds)
    if (is_joint(manifold)) joints.push_back(joint_of(manifold));
  const std::vector<std::vector<std::uint32_t>> neighbours = neighbours_of(scene, ids, joints);
  const std::vector<std::uint32_t> order = elimination_order(neighbours);
  std::vector<std::uint32_t> place(order.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) place[order[i]] = i;
  for (std::uint32_t i = 0; i < order.size(); ++i) {
    std::uint32_t earliest = i;
    for (const std::uint32_t other : neighbours[order[i]])
      earliest = std::min(earliest, place[other]);
    system.joints.push_back(joints[order[i]]);
    system.earliest.push_back(earliest);
  }
  return system;
}

bool has_springs(const SceneDescription& scene, const JointSystem& system) {
  return std::ranges::any_of(system.joints, [&scene](std::uint32_t joint) {
    return scene.joints[joint].kind == JointKind::kSpring;
  });
}

void build_joint_rows(const SceneDescription& scene, double dt_s, std::span<const BodyId> ids,
                      std::span<const BodyState> states, bool with_springs, JointSystem& system) {
  system.rows.clear();
  system.first_row.assign(1, 0);
  for (const std::uint32_t index : system.joints) {
    const Joint& joint = scene.joints[index];
    const End a = end_of(ids, states, joint.a, joint.anchor_a_m, joint.frame_a);
    const End b = end_of(ids, states, joint.b, joint.anchor_b_m, joint.frame_b);
    add_rows(joint, dt_s, with_springs, a, b, system.rows);
    system.first_row.push_back(static_cast<std::uint32_t>(system.rows.size()));
  }
}

void factor_joint_rows(std::size_t body_count, std::span<const SolverBody> bodies,
                       JointSystem& system, double regularisation) {
  const auto world = static_cast<std::uint32_t>(body_count);
  const std::vector<std::uint32_t>& begin = system.first_row;
  std::vector<std::uint32_t> first(system.rows.size());
  for (std::size_t j = 0; j < system.joints.size(); ++j)
    std::fill(first.begin() + begin[j], first.begin() + begin[j + 1], begin[system.earliest[j]]);
  system.matrix.reset(first);
  for (std::size_t j = 0; j < system.joints.size(); ++j)
    for (std::size_t k = system.earliest[j]; k <= j; ++k) {
      if (!share_a_body(system.rows[begin[j]], system.rows[begin[k]], world)) continue;
      for (std::uint32_t r = begin[j]; r < begin[j + 1]; ++r)
        for (std::uint32_t c = begin[k]; c < begin[k + 1] && c <= r; ++c)
          system.matrix.at(r, c) =
              coupling(system.rows[r], system.rows[c], bodies.first(body_count));
    }
  for (std::size_t r = 0; r < system.rows.size(); ++r)
    system.matrix.at(r, r) +=
        system.rows[r].softness_1_kg + regularisation * system.matrix.at(r, r);
  system.matrix.factor();
}

namespace {

double velocity_of(const JointRow& row, std::span<const SolverBody> bodies) {
  const SolverBody& a = bodies[row.a];
  const SolverBody& b = bodies[row.b];
  return row.linear.dot(b.linear - a.linear) + row.turn_b.dot(b.angular) -
         row.turn_a.dot(a.angular);
}

void apply(const JointRow& row, double impulse, std::span<SolverBody> bodies) {
  SolverBody& a = bodies[row.a];
  SolverBody& b = bodies[row.b];
  a.linear -= row.linear * (a.inverse_mass * impulse);
  a.angular -= a.inverse_inertia * row.turn_a * impulse;
  b.linear += row.linear * (b.inverse_mass * impulse);
  b.angular += b.inverse_inertia * row.turn_b * impulse;
}

// `change` are the right-hand sides, and then the impulses.
void add_impulses(std::span<double> change, JointSystem& system, std::span<SolverBody> bodies) {
  system.matrix.solve(change);
  for (std::size_t r = 0; r < change.size(); ++r) {
    system.rows[r].impulse_newton_s += change[r];
    apply(system.rows[r], change[r], bodies);
  }
}

}  // namespace

// Springs: impulse = -dt (stiffness * stretch at the end + damping * velocity), with the stretch at
// the end linear in the velocity. Joints: the same with a stiffness without bound.
void aim_joint_rows(double dt_s, std::span<const SolverBody> bodies, JointSystem& system) {
  for (JointRow& row : system.rows) {
    const double share = row.softness_1_kg > 0.0 ? row.stiffness_share_1_s : 1.0 / dt_s;
    row.target_m_s = share * (dt_s * velocity_of(row, bodies) - row.error);
  }
}

void take_back_joint_impulses(JointSystem& system, std::span<SolverBody> bodies) {
  for (JointRow& row : system.rows) apply(row, -row.impulse_newton_s, bodies);
}

void add_joint_impulses(JointSystem& system, std::span<SolverBody> bodies) {
  std::vector<double> change;
  for (const JointRow& row : system.rows) change.push_back(-row.error);
  add_impulses(change, system, bodies);
}

void solve_joint_velocities(JointSystem& system, std::span<SolverBody> bodies) {
  std::vector<double> change(system.rows.size());
  for (std::size_t r = 0; r < change.size(); ++r) {
    const JointRow& row = system.rows[r];
    change[r] =
        row.target_m_s - velocity_of(row, bodies) - row.softness_1_kg * row.impulse_newton_s;
  }
  add_impulses(change, system, bodies);
}

void stop_joint_velocities(std::size_t body_count, std::span<SolverBody> bodies,
                           JointSystem& system) {
  const std::vector<SolverBody> before(bodies.begin(), bodies.end());
  for (const double regularisation : {0.0, 1e-10, 1e-8, 1e-6, 1e-4}) {
    factor_joint_rows(body_count, bodies, system, regularisation);
    solve_joint_velocities(system, bodies);
    double gained = 0.0, moved = 0.0;  // energy: half the impulses times both velocities
    for (const JointRow& row : system.rows) {
      const double work =
          0.5 * row.impulse_newton_s * (velocity_of(row, before) + velocity_of(row, bodies));
      gained += work;
      moved += std::abs(work);
    }
    if (gained <= 1e-9 * moved) return;
    std::copy(before.begin(), before.end(), bodies.begin());
    for (JointRow& row : system.rows) row.impulse_newton_s = 0.0;
  }
}

void solve_joint_errors(const JointSystem& system, std::span<const SolverBody> bodies,
                        std::vector<JointMove>& moves) {
  std::vector<double> push(system.rows.size());
  for (std::size_t r = 0; r < push.size(); ++r)
    push[r] = system.rows[r].softness_1_kg > 0.0 ? 0.0 : -system.rows[r].error;
  system.matrix.solve(push);
  moves.assign(bodies.size(), {});
  for (std::size_t r = 0; r < push.size(); ++r) {
    const JointRow& row = system.rows[r];
    JointMove& a = moves[row.a];
    JointMove& b = moves[row.b];
    a.linear -= row.linear * (bodies[row.a].inverse_mass * push[r]);
    a.angular -= bodies[row.a].inverse_inertia * row.turn_a * push[r];
    b.linear += row.linear * (bodies[row.b].inverse_mass * push[r]);
    b.angular += bodies[row.b].inverse_inertia * row.turn_b * push[r];
  }
}

double largest_error(const JointSystem& system) {
  double largest = 0.0;
  for (const JointRow& row : system.rows)
    if (!(row.softness_1_kg > 0.0)) largest = std::max(largest, std::abs(row.error));
  return largest;
}

}  // namespace soda::physics
