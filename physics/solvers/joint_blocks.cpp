#include "physics/solvers/joint_blocks.hpp"

#include <algorithm>
#include <cmath>

#include "physics/math/rigid_motion.hpp"
#include "physics/model/joint.hpp"

namespace soda::physics {
namespace {
// Closing, as by a spring of a quarter of an oscillation a substep and twice the critical damping:
// the share of what is open that goes, and of the impulse that it gives way. Closed at once, what
// sweeps leave unsolved makes large nets flutter.
constexpr double kTurn = 2.0 * 3.14159265358979323846 * 0.25;
constexpr double kDamping = 2.0;
constexpr double kFirm = kTurn * (2.0 * kDamping + kTurn);
constexpr double kRate = kTurn / (2.0 * kDamping + kTurn);
constexpr double kMassShare = kFirm / (1.0 + kFirm), kImpulseShare = 1.0 / (1.0 + kFirm);

bool is_bounded(const JointRow& row) {
  return row.kind == JointRowKind::kLimit || row.kind == JointRowKind::kMotor;
}

// What an impulse along row y does to row x of the same joint.
double response(const JointRow& x, const JointRow& y, const RowTwist& twist, const SolverBody& a,
                const SolverBody& b) {
  return (a.inverse_mass + b.inverse_mass) * x.linear.dot(y.linear) + x.turn_a.dot(twist.a) +
         x.turn_b.dot(twist.b);
}

// In place, of the lower triangle; a row that depends on others gets no impulse.
void factorise(std::uint32_t n, std::array<double, kMostHeldRows * kMostHeldRows>& m) {
  constexpr double kDependent = 1e-12;  // of the diagonal
  for (std::uint32_t i = 0; i < n; ++i) {
    double* const row = &m[i * kMostHeldRows];
    const double whole = row[i];
    double left = whole;
    for (std::uint32_t j = 0; j < i; ++j) {
      const double* const other = &m[j * kMostHeldRows];
      for (std::uint32_t k = 0; k < j; ++k) row[j] -= row[k] * other[k];
    }
    for (std::uint32_t j = 0; j < i; ++j) {
      const double scaled = row[j] * m[j * kMostHeldRows + j];
      left -= scaled * row[j];
      row[j] = scaled;
    }
    row[i] = left > kDependent * whole ? 1.0 / left : 0.0;
  }
}

void solve(const JointBlock& block, std::array<double, kMostHeldRows>& v) {
  const std::uint32_t n = block.held;
  for (std::uint32_t i = 1; i < n; ++i)
    for (std::uint32_t k = 0; k < i; ++k) v[i] -= block.factor[i * kMostHeldRows + k] * v[k];
  for (std::uint32_t i = 0; i < n; ++i) v[i] *= block.factor[i * kMostHeldRows + i];
  for (std::uint32_t i = n; i-- > 1;)
    for (std::uint32_t k = 0; k < i; ++k) v[k] -= block.factor[i * kMostHeldRows + k] * v[i];
}

void give(const JointRow& row, const RowTwist& twist, double impulse, SolverBody& a,
          SolverBody& b) {
  a.linear -= row.linear * (a.inverse_mass * impulse);
  a.angular -= twist.a * impulse;
  b.linear += row.linear * (b.inverse_mass * impulse);
  b.angular += twist.b * impulse;
}

double velocity(const JointRow& row, const SolverBody& a, const SolverBody& b) {
  return row.linear.dot(b.linear - a.linear) + row.turn_b.dot(b.angular) -
         row.turn_a.dot(a.angular);
}

template <bool kPresses>
double target_of(const JointRow& row, double per_second, double most_m_s) {
  if (row.kind == JointRowKind::kSpring || row.kind == JointRowKind::kMotor) return row.target_m_s;
  if (row.kind == JointRowKind::kLimit && row.error > 0.0) return -row.error * per_second;
  return kPresses ? std::clamp(-kRate * row.error * per_second, -most_m_s, most_m_s) : 0.0;
}

template <bool kPresses>
void sweep_joint(double length_s, double most_m_s, const JointBlocks& blocks,
                 const JointBlock& block, JointSystem& system, std::span<SolverBody> bodies) {
  const double per_second = 1.0 / length_s;
  JointRow* const rows = system.rows.data();
  SolverBody &a = bodies[rows[block.first].a], &b = bodies[rows[block.first].b];
  for (std::uint32_t r = block.first + block.held; r < block.end; ++r) {
    JointRow& row = rows[r];
    const double missing = target_of<kPresses>(row, per_second, most_m_s) - velocity(row, a, b);
    const double wanted = row.impulse_newton_s + blocks.mass[r] * missing;
    const double most = row.kind == JointRowKind::kMotor ? row.most_push * length_s : 1e300;
    const double least = row.kind == JointRowKind::kMotor ? -most : 0.0;
    const double change = std::clamp(wanted, least, most) - row.impulse_newton_s;
    if (change == 0.0) continue;
    row.impulse_newton_s += change;
    give(row, system.twists[r], change, a, b);
  }
  std::array<double, kMostHeldRows> change;
  for (std::uint32_t i = 0; i < block.held; ++i) {
    const JointRow& row = rows[block.first + i];
    change[i] = target_of<kPresses>(row, per_second, most_m_s) - velocity(row, a, b) -
                row.softness_1_kg * row.impulse_newton_s;
  }
  solve(block, change);
  const bool closes = kPresses && rows[block.first].kind == JointRowKind::kHolds;
  if (closes)
    for (std::uint32_t i = 0; i < block.held; ++i)
      change[i] = kMassShare * change[i] - kImpulseShare * rows[block.first + i].impulse_newton_s;
  for (std::uint32_t i = 0; i < block.held; ++i) {
    rows[block.first + i].impulse_newton_s += change[i];
    give(rows[block.first + i], system.twists[block.first + i], change[i], a, b);
  }
}

bool turns_only(const JointRow& row) { return row.linear == Vec3::Zero(); }

}  // namespace

void build_joint_blocks(std::span<const SolverBody> bodies, JointSystem& system,
                        JointBlocks& blocks) {
  const std::vector<JointRow>& rows = system.rows;
  blocks.blocks.resize(system.joints.size());
  blocks.mass.assign(rows.size(), 0.0);
  system.twists.resize(rows.size());
  for (std::size_t j = 0; j < system.joints.size(); ++j) {
    JointBlock& block = blocks.blocks[j];
    block.first = system.first_row[j];
    block.end = system.first_row[j + 1];
    block.held = 0;
    const SolverBody &a = bodies[rows[block.first].a], &b = bodies[rows[block.first].b];
    for (std::uint32_t r = block.first; r < block.end; ++r) {
      system.twists[r] = {times(a.inverse_inertia, rows[r].turn_a),
                          times(b.inverse_inertia, rows[r].turn_b)};
      if (is_bounded(rows[r])) {
        blocks.mass[r] = 1.0 / response(rows[r], rows[r], system.twists[r], a, b);
        continue;
      }
      double* const line = &block.factor[block.held * kMostHeldRows];
      for (std::uint32_t k = 0; k <= block.held; ++k)
        line[k] = response(rows[r], rows[block.first + k], system.twists[block.first + k], a, b);
      line[block.held] += rows[r].softness_1_kg;
      ++block.held;
    }
    factorise(block.held, block.factor);
  }
}

void press_joints(double length_s, double most_m_s, const JointBlocks& blocks, JointSystem& system,
                  std::span<SolverBody> bodies) {
  for (const JointBlock& block : blocks.blocks)
    sweep_joint<true>(length_s, most_m_s, blocks, block, system, bodies);
}

void relax_joints(double length_s, bool forward, const JointBlocks& blocks, JointSystem& system,
                  std::span<SolverBody> bodies) {
  const std::size_t count = blocks.blocks.size();
  for (std::size_t k = 0; k < count; ++k)
    sweep_joint<false>(length_s, 0.0, blocks, blocks.blocks[forward ? k : count - 1 - k], system,
                       bodies);
}

void load_joint_impulses(const SceneDescription& scene, std::span<const BodyState> states,
                         JointSystem& system) {
  for (std::size_t j = 0; j < system.joints.size(); ++j) {
    const BodyId other = scene.joints[system.joints[j]].b;
    const std::uint32_t part = kFirstJointPart + system.joints[j];
    const std::vector<ContactImpulse>& stored = states[system.bodies[j][0]].impulses;
    const auto at = [&](std::uint32_t feature) -> const ContactImpulse* {
      const std::array key{index_of(other), part, feature};
      const auto found = std::lower_bound(
          stored.begin(), stored.end(), key, [](const ContactImpulse& x, const auto& y) {
            return std::array{index_of(x.other), x.part, x.feature} < y;
          });
      if (found == stored.end() || found->other != other || found->part != part ||
          found->feature != feature)
        return nullptr;
      return &*found;
    };
    std::uint32_t limit = 0;
    for (std::uint32_t r = system.first_row[j]; r < system.first_row[j + 1]; ++r) {
      JointRow& row = system.rows[r];
      const bool motor = row.kind == JointRowKind::kMotor;
      const bool turns = turns_only(row);
      const bool bounded = is_bounded(row);
      const ContactImpulse* const one = at(motor ? 2 : bounded ? limit++ : turns ? 1 : 0);
      if (one == nullptr) continue;
      row.impulse_newton_s = bounded ? one->normal_newton_s
                                     : one->friction_newton_s.dot(turns ? row.turn_b : row.linear);
    }
  }
}

void append_joint_impulses(const SceneDescription& scene, std::uint32_t joint_place,
                           std::span<const double> impulses, const JointSystem& system,
                           std::vector<ContactImpulse>& out) {
  const std::uint32_t joint = system.joints[joint_place];
  std::array<ContactImpulse, 3> entries;
  for (std::uint32_t f = 0; f < entries.size(); ++f)
    entries[f] = {scene.joints[joint].b, kFirstJointPart + joint, f, 0.0, Vec3::Zero()};
  std::uint32_t limit = 0;
  for (std::uint32_t r = system.first_row[joint_place]; r < system.first_row[joint_place + 1];
       ++r) {
    const JointRow& row = system.rows[r];
    if (row.kind == JointRowKind::kMotor)
      entries[2].normal_newton_s = impulses[r];
    else if (row.kind == JointRowKind::kLimit)
      entries[limit++].normal_newton_s = impulses[r];
    else if (turns_only(row))
      entries[1].friction_newton_s += row.turn_b * impulses[r];
    else
      entries[0].friction_newton_s += row.linear * impulses[r];
  }
  for (const ContactImpulse& entry : entries)
    if (entry.normal_newton_s != 0.0 || entry.friction_newton_s != Vec3::Zero())
      out.push_back(entry);
}

}  // namespace soda::physics
