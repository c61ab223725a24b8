#include "physics/solvers/convex_contacts.hpp"

#include <array>
#include <cmath>

#include "physics/math/rigid_motion.hpp"
#include "physics/math/two_lanes.hpp"

namespace soda::physics {
namespace {

using SixVector = std::array<double, 6>;

// Adds weight * [I, -[c]x; [r]x, -[r]x [c]x] for the arms r of the row and c of the column: a point
// that answers alike in all directions.
void add_sticking(const Vec3& r, const Vec3& c, double weight, Block& out) {
  const double dot = r.dot(c) * weight;
  const Vec3 row = r * weight, column = c * weight;
  for (int i = 0; i < 3; ++i) {
    out[7 * i] += weight;
    out[7 * (i + 3)] += dot;
    for (int j = 0; j < 3; ++j) out[6 * (j + 3) + i + 3] -= column[i] * r[j];
  }
  const auto add_cross = [&out](const Vec3& v, int first) {  // [v]x, from entry `first` on
    out[first + 1] += v.z();
    out[first + 2] -= v.y();
    out[first + 6] -= v.z();
    out[first + 8] += v.x();
    out[first + 12] += v.y();
    out[first + 13] -= v.x();
  };
  add_cross(row, 3);
  add_cross(-column, 18);
}

SixVector wrench(const Vec3& direction, const Vec3& arm) {
  const Vec3 angular = arm.cross(direction);
  return {direction.x(), direction.y(), direction.z(), angular.x(), angular.y(), angular.z()};
}

void add_product(const SixVector& row, const SixVector& column, double weight, Block& out) {
  const Two top = load(&row[0]), middle = load(&row[2]), bottom = load(&row[4]);
  for (int c = 0; c < 6; ++c) {
    const Two factor = both(column[c] * weight);
    store(load(&out[6 * c]) + top * factor, &out[6 * c]);
    store(load(&out[6 * c + 2]) + middle * factor, &out[6 * c + 2]);
    store(load(&out[6 * c + 4]) + bottom * factor, &out[6 * c + 4]);
  }
}

// Of a diagonal block, whose upper triangle nobody reads.
void add_square(const SixVector& v, double weight, Block& out) {
  const Two top = load(&v[0]), middle = load(&v[2]), bottom = load(&v[4]);
  for (int c = 0; c < 6; ++c) {
    const Two factor = both(v[c] * weight);
    if (c < 2) store(load(&out[6 * c]) + top * factor, &out[6 * c]);
    if (c < 4) store(load(&out[6 * c + 2]) + middle * factor, &out[6 * c + 2]);
    store(load(&out[6 * c + 4]) + bottom * factor, &out[6 * c + 4]);
  }
}

// What a point adds to the blocks of its bodies: the derivative of its impulse. A sliding one
// answers along its cone, and less across its motion. By the exact laws (alart_curnier.hpp) it
// feels the normal velocity only, which makes the blocks unsymmetric.
class PointBlocks {
 public:
  PointBlocks(const ConvexPoint& point, const PointResponse& response, double stiffness_kg,
              bool exact)
      : sticks_(response.mode == ContactMode::kStick),
        exact_(exact),
        stiffness_kg_(stiffness_kg),
        aside_kg_(response.aside * stiffness_kg),
        a_{point.arm_a, {}, {}, {}},
        b_{point.arm_b, {}, {}, {}} {
    if (sticks_) return;
    Vec3 edge = point.normal + response.along * point.friction;
    if (!exact) edge *= 1.0 / std::sqrt(1.0 + point.friction * point.friction);
    const Vec3 across = point.normal.cross(response.along);
    for (Side* const side : {&a_, &b_}) {
      side->pushed = wrench(edge, side->arm);
      side->felt = exact ? wrench(point.normal, side->arm) : side->pushed;
      side->across = wrench(across, side->arm);
    }
  }

  void add_a(Block& out) const { add_own(a_, out); }
  void add_b(Block& out) const { add_own(b_, out); }
  // `row_is_b`: of the block below the diagonal.
  void add_both(bool row_is_b, Block& lower) const {
    const Side &row = row_is_b ? b_ : a_, &column = row_is_b ? a_ : b_;
    add(row.pushed, column.felt, row, column, lower);
  }
  // Of the one above it, transposed.
  void add_transposed(bool row_is_b, Block& upper) const {
    const Side &row = row_is_b ? b_ : a_, &column = row_is_b ? a_ : b_;
    add(row.felt, column.pushed, row, column, upper);
  }

 private:
  struct Side {
    Vec3 arm = Vec3::Zero();
    SixVector pushed{}, felt{}, across{};
  };
  void add(const SixVector& of_row, const SixVector& of_column, const Side& row, const Side& column,
           Block& out) const {
    if (sticks_) return add_sticking(row.arm, column.arm, -stiffness_kg_, out);
    add_product(of_row, of_column, -stiffness_kg_, out);
    if (aside_kg_ != 0.0) add_product(row.across, column.across, -aside_kg_, out);
  }
  void add_own(const Side& side, Block& out) const {
    if (sticks_) return add_sticking(side.arm, side.arm, stiffness_kg_, out);
    if (exact_) {
      add_product(side.pushed, side.felt, stiffness_kg_, out);
      if (aside_kg_ != 0.0) add_product(side.across, side.across, aside_kg_, out);
    } else {
      add_square(side.pushed, stiffness_kg_, out);
      if (aside_kg_ != 0.0) add_square(side.across, aside_kg_, out);
    }
  }

  bool sticks_, exact_;
  double stiffness_kg_, aside_kg_;
  Side a_, b_;
};

void add_mass(const ConvexBody& body, Block& out) {
  for (int i = 0; i < 3; ++i) {
    out[7 * i] += body.mass_kg;
    for (int j = 0; j < 3; ++j) out[6 * (i + 3) + j + 3] += body.inertia_kg_m2(j, i);
  }
}

}  // namespace

void gradient(const ConvexContacts& problem, std::span<const Twist> twists,
              const Responses& responses, std::vector<Twist>& out) {
  out.resize(twists.size());
  for (std::size_t i = 0; i < twists.size(); ++i) {
    const ConvexBody& body = problem.bodies[i];
    out[i].linear = (twists[i].linear - problem.free[i].linear) * body.mass_kg;
    out[i].angular = times(body.inertia_kg_m2, twists[i].angular - problem.free[i].angular);
  }
  const std::vector<PointResponse>& points = responses.points;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (points[i].mode == ContactMode::kOpen) continue;
    const ConvexPoint& p = problem.points[i];
    const Vec3& impulse = points[i].impulse_newton_s;
    out[p.a].linear += impulse;
    out[p.a].angular += p.arm_a.cross(impulse);
    if (p.b >= twists.size()) continue;
    out[p.b].linear -= impulse;
    out[p.b].angular -= p.arm_b.cross(impulse);
  }
  for (std::size_t i = 0; i < responses.turnings.size(); ++i) {
    const ConvexTurning& turning = problem.turnings[i];
    const Vec3 torque = responses.turnings[i].impulse_newton_s * turning.gyration_m;
    out[turning.a].angular += torque;
    if (turning.b < twists.size()) out[turning.b].angular -= torque;
  }
  for (std::size_t i = 0; i < responses.rows.size(); ++i) {
    const ConvexRow& row = problem.rows[i];
    const double impulse = responses.rows[i].impulse_newton_s;
    out[row.a].linear += row.linear * impulse;
    out[row.a].angular += row.angular_a * impulse;
    if (row.b >= twists.size()) continue;
    out[row.b].linear -= row.linear * impulse;
    out[row.b].angular -= row.angular_b * impulse;
  }
  for (std::size_t i = 0; i < twists.size(); ++i)
    if (problem.bodies[i].is_kinematic) out[i] = {};
}

double largest_m_s(const ConvexContacts& problem, std::span<const Twist> gradient) {
  double squared = 0.0;
  for (std::size_t i = 0; i < gradient.size(); ++i) {
    const double mass = problem.bodies[i].mass_kg;
    const double moment = problem.bodies[i].inertia_kg_m2.trace() / 3.0;
    squared = std::max(squared, gradient[i].linear.squaredNorm() / (mass * mass));
    squared = std::max(squared, gradient[i].angular.squaredNorm() / (mass * moment));
  }
  return std::sqrt(squared);
}

namespace {

SixVector six(const Vec3& linear, const Vec3& angular) {
  return {linear.x(), linear.y(), linear.z(), angular.x(), angular.y(), angular.z()};
}

void add_row(const ConvexRow& row, const Elimination& plan, std::uint32_t count,
             std::vector<Block>& out) {
  const SixVector a = six(row.linear, row.angular_a), b = six(row.linear, row.angular_b);
  add_product(a, a, row.stiffness_kg, out[plan.block_of(row.a, row.a)]);
  if (row.b >= count) return;
  add_product(b, b, row.stiffness_kg, out[plan.block_of(row.b, row.b)]);
  const bool row_is_b = plan.place_of[row.b] > plan.place_of[row.a];
  add_product(row_is_b ? b : a, row_is_b ? a : b, -row.stiffness_kg,
              out[plan.block_of(row.a, row.b)]);
}

bool fits(const BodyBlocks& bodies, std::span<const RowResponse> rows) {
  bool same = !bodies.blocks.empty();
  for (std::size_t i = 0; same && i < rows.size(); ++i) same = bodies.held[i] == rows[i].held;
  return same;
}

void assemble_bodies(const ConvexContacts& problem, const Elimination& plan,
                     std::span<const RowResponse> rows, BodyBlocks& bodies) {
  if (fits(bodies, rows)) return;
  std::vector<Block>& out = bodies.blocks;
  out.assign(plan.rows.size(), Block{});
  bodies.held.resize(rows.size());
  const std::uint32_t count = static_cast<std::uint32_t>(problem.bodies.size());
  for (std::uint32_t i = 0; i < count; ++i) add_mass(problem.bodies[i], out[plan.block_of(i, i)]);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    bodies.held[i] = rows[i].held;
    if (rows[i].held) add_row(problem.rows[i], plan, count, out);
  }
}

// Of rotations only: the derivative of the impulse in the plane and about the normal.
Mat3 answer_of(const ConvexTurning& turning, const TurningResponse& response) {
  const Vec3 &n = turning.normal, &along = response.along;
  const Vec3 about = n * (response.spin_held ? 1.0 : 0.0);
  const Vec3 across = n.cross(along) * response.aside;
  Mat3 out;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const double plane = (i == j ? 1.0 : 0.0) - n[i] * n[j];
      out(i, j) = about[i] * n[j] + (response.rolls_held ? plane : across[i] * n.cross(along)[j]);
    }
  return out;
}

void add_rotational(const Mat3& answer, double weight, Block& out) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) out[6 * (i + 3) + j + 3] += answer(j, i) * weight;
}

void assemble_turnings(const ConvexContacts& problem, const Elimination& plan,
                       std::span<const TurningResponse> responses, std::vector<Block>& lower,
                       std::vector<Block>* upper) {
  const std::uint32_t count = static_cast<std::uint32_t>(problem.bodies.size());
  for (std::size_t i = 0; i < responses.size(); ++i) {
    const ConvexTurning& t = problem.turnings[i];
    const double weight = t.gyration_m * t.gyration_m / problem.compliance_1_kg;
    const Mat3 answer = answer_of(t, responses[i]);
    const bool moves_a = !problem.bodies[t.a].is_kinematic;
    if (moves_a) add_rotational(answer, weight, lower[plan.block_of(t.a, t.a)]);
    if (t.b >= count || problem.bodies[t.b].is_kinematic) continue;
    add_rotational(answer, weight, lower[plan.block_of(t.b, t.b)]);
    if (!moves_a) continue;
    const std::uint32_t joint = plan.block_of(t.a, t.b);
    add_rotational(answer, -weight, lower[joint]);
    if (upper != nullptr) add_rotational(answer, -weight, (*upper)[joint]);
  }
}

// `upper`: none, or of the exact laws.
void assemble_points(const ConvexContacts& problem, const Elimination& plan,
                     const Responses& responses, std::vector<Block>& lower,
                     std::vector<Block>* upper) {
  const std::uint32_t count = static_cast<std::uint32_t>(problem.bodies.size());
  const double stiffness_kg = 1.0 / problem.compliance_1_kg;
  std::uint32_t a = count, b = count, joint = 0;  // the last pair, and its block
  for (std::size_t i = 0; i < responses.points.size(); ++i) {
    if (responses.points[i].mode == ContactMode::kOpen) continue;
    const ConvexPoint& p = problem.points[i];
    const PointBlocks blocks(p, responses.points[i], stiffness_kg, upper != nullptr);
    const bool moves_a = !problem.bodies[p.a].is_kinematic;
    if (moves_a) blocks.add_a(lower[plan.block_of(p.a, p.a)]);
    if (p.b >= count || problem.bodies[p.b].is_kinematic) continue;
    blocks.add_b(lower[plan.block_of(p.b, p.b)]);
    if (!moves_a) continue;
    if (p.a != a || p.b != b) joint = plan.block_of(a = p.a, b = p.b);
    // The row is the body that is eliminated later.
    const bool row_is_b = plan.place_of[p.b] > plan.place_of[p.a];
    blocks.add_both(row_is_b, lower[joint]);
    if (upper != nullptr) blocks.add_transposed(row_is_b, (*upper)[joint]);
  }
}

}  // namespace

void assemble(const ConvexContacts& problem, const Elimination& plan, const Responses& responses,
              BodyBlocks& bodies, std::vector<Block>& out) {
  assemble_bodies(problem, plan, responses.rows, bodies);
  out = bodies.blocks;
  assemble_points(problem, plan, responses, out, nullptr);
  assemble_turnings(problem, plan, responses.turnings, out, nullptr);
}

void assemble(const ConvexContacts& problem, const Elimination& plan, const Responses& responses,
              BodyBlocks& bodies, BlockMatrix& out) {
  assemble_bodies(problem, plan, responses.rows, bodies);
  out.lower = out.upper = bodies.blocks;
  assemble_points(problem, plan, responses, out.lower, &out.upper);
  assemble_turnings(problem, plan, responses.turnings, out.lower, &out.upper);
}

}  // namespace soda::physics
