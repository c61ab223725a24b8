// The contacts of an island as a convex problem: find body velocities v that minimise
//   1/2 (v - free)^T M (v - free) + sum over points of compliance/2 |P(y)|^2,
//   y = start + (target - u) / compliance,
// over what contacts do against rotations (convex_turning.hpp) and over rows of joints the same
// with bounds, where u is the relative velocity at the point, P the projection into the friction
// cone and P(y) the point's impulse. All vectors in the world frame.
//
// Sources: the convex relaxation of Coulomb's law is that of M. Anitescu, "Optimization-based
// simulation of nonsmooth rigid multibody dynamics", Math. Programming 105, 2006. The compliant
// form without constraints, as above, is that of A. M. Castro, F. N. Permenter, X. Han, "An
// unconstrained convex formulation of compliant contact", IEEE Trans. Robotics 39, 2023. Deviation:
// one compliance for all points and directions, which newton_solver.hpp takes out again.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "physics/math/block_lu.hpp"
#include "physics/model/ids.hpp"
#include "physics/solvers/convex_turning.hpp"

namespace soda::physics {

struct Twist {
  Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
};

struct ConvexPoint {
  std::uint32_t a = 0, b = 0;  // b may be one past the last body: immovable
  Vec3 normal = Vec3::Zero();
  Vec3 arm_a = Vec3::Zero(), arm_b = Vec3::Zero();
  double friction = 0.0;
  Vec3 target_m_s = Vec3::Zero();  // of b against a; the de Saxce shift included
  Vec3 start_newton_s = Vec3::Zero();
};

enum class ContactMode : std::uint8_t { kOpen, kStick, kSlide };

// Where a point's impulse lies in its cone.
struct PointResponse {
  ContactMode mode = ContactMode::kOpen;
  Vec3 impulse_newton_s = Vec3::Zero();
  Vec3 along = Vec3::Zero();  // unit, tangential, where it slides
  double aside = 0.0;         // in [0, 1]: how the impulse answers across `along`, where it slides
};

struct ConvexBody {
  double mass_kg = 0.0;
  Mat3 inertia_kg_m2 = Mat3::Zero();
  bool is_kinematic = false;  // keeps its free velocity; mass and inertia are any > 0
};

// One row of a joint: its velocity is linear . (v_b - v_a) + angular_b . w_b - angular_a . w_a.
struct ConvexRow {
  std::uint32_t a = 0, b = 0;
  Vec3 linear = Vec3::Zero(), angular_a = Vec3::Zero(), angular_b = Vec3::Zero();
  double target_m_s = 0.0, start_newton_s = 0.0;
  double stiffness_kg = 0.0;  // 1 / compliance
  double least_newton_s = 0.0, most_newton_s = 0.0;
  double speed = 1.0;  // of a unit of its velocity, m/s: that of the same energy
  bool soft = false;   // a spring: its compliance is meant
};

struct ConvexContacts {
  std::vector<ConvexBody> bodies;
  std::vector<Twist> free;  // velocities without contacts
  std::vector<ConvexPoint> points;
  std::vector<ConvexTurning> turnings;
  std::vector<ConvexRow> rows;
  double compliance_1_kg = 0.0;  // > 0
};

// For the relative velocity at the point; `stiffness_kg` is 1 / compliance. These two are the inner
// loop of Newton's method, so they are defined here.
[[gnu::always_inline]] inline PointResponse respond(const ConvexPoint& p, double stiffness_kg,
                                                    const Vec3& velocity_m_s) {
  const Vec3 y = p.start_newton_s + (p.target_m_s - velocity_m_s) * stiffness_kg;
  const double normal = y.dot(p.normal);
  const Vec3 tangential = y - p.normal * normal;
  const double squared = tangential.squaredNorm();
  const double limit = p.friction * normal;
  PointResponse out;
  if (normal >= 0.0 && squared <= limit * limit) {
    out.mode = ContactMode::kStick;
    out.impulse_newton_s = y;
    return out;
  }
  if (normal <= 0.0 && p.friction * p.friction * squared <= normal * normal) return out;
  const double size = std::sqrt(squared);
  const double pressing = (normal + p.friction * size) / (1.0 + p.friction * p.friction);
  out.mode = ContactMode::kSlide;
  out.along = size > 0.0 ? Vec3(tangential * (1.0 / size)) : Vec3(Vec3::Zero());
  out.impulse_newton_s = p.normal * pressing + out.along * (p.friction * pressing);
  out.aside = size > 0.0 ? p.friction * pressing / size : 0.0;
  return out;
}

[[gnu::always_inline]] inline Vec3 relative_velocity(const ConvexPoint& p,
                                                     std::span<const Twist> twists) {
  const Twist& a = twists[p.a];
  Vec3 velocity = -(a.linear + a.angular.cross(p.arm_a));
  if (p.b < twists.size()) {
    const Twist& b = twists[p.b];
    velocity += b.linear + b.angular.cross(p.arm_b);
  }
  return velocity;
}

struct RowResponse {
  double impulse_newton_s = 0.0;
  double wanted_newton_s = 0.0;  // without bounds
  bool held = false;             // within its bounds
};

inline double relative_velocity(const ConvexRow& row, std::span<const Twist> twists) {
  const Twist& a = twists[row.a];
  double velocity = -row.linear.dot(a.linear) - row.angular_a.dot(a.angular);
  if (row.b < twists.size())
    velocity += row.linear.dot(twists[row.b].linear) + row.angular_b.dot(twists[row.b].angular);
  return velocity;
}

inline RowResponse respond(const ConvexRow& row, double velocity_m_s) {
  const double wanted = row.start_newton_s + (row.target_m_s - velocity_m_s) * row.stiffness_kg;
  if (wanted <= row.least_newton_s) return {row.least_newton_s, wanted, false};
  if (wanted >= row.most_newton_s) return {row.most_newton_s, wanted, false};
  return {wanted, wanted, true};
}

// How points, what they do against rotations, and rows answer.
struct Responses {
  std::vector<PointResponse> points;
  std::vector<TurningResponse> turnings;
  std::vector<RowResponse> rows;
};

// M (v - free) - J^T impulses, one per body.
void gradient(const ConvexContacts& problem, std::span<const Twist> twists,
              const Responses& responses, std::vector<Twist>& out);

// The largest speed that a body alone would get from what is missing in its balance; of angular
// velocities, that of the same energy.
double largest_m_s(const ConvexContacts& problem, std::span<const Twist> gradient);

// Of masses and of the rows that are held, as last assembled: most of the matrix, and the same in
// most steps of Newton's method.
struct BodyBlocks {
  std::vector<Block> blocks;  // none: not assembled
  std::vector<bool> held;     // of the rows
};

// M + J^T G J / compliance in the pattern of `plan`. `bodies`: of this problem, with none where
// masses or the stiffness of rows are no longer what they were.
void assemble(const ConvexContacts& problem, const Elimination& plan, const Responses& responses,
              BodyBlocks& bodies, std::vector<Block>& out);

// The same of the exact laws: what slides answers along n + friction * along, and to the normal
// velocity only (and across its motion as above).
void assemble(const ConvexContacts& problem, const Elimination& plan, const Responses& responses,
              BodyBlocks& bodies, BlockMatrix& out);

}  // namespace soda::physics
