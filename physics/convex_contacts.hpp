// The contacts of an island as a convex problem: find body velocities v that minimise
//   1/2 (v - free)^T M (v - free) + sum over points of compliance/2 |P(y)|^2,
//   y = start + (target - u) / compliance,
// where u is the relative velocity at the point, P the projection into the friction cone and P(y)
// the point's impulse. All vectors in the world frame.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/block_cholesky.hpp"
#include "physics/ids.hpp"

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
};

struct ConvexContacts {
  std::vector<ConvexBody> bodies;
  std::vector<Twist> free;  // velocities without contacts
  std::vector<ConvexPoint> points;
  double compliance_1_kg = 0.0;  // > 0
};

// By cofactors; for symmetric positive definite matrices.
Mat3 inverse_of_symmetric(const Mat3& m);

PointResponse respond(const ConvexPoint& point, double compliance_1_kg, const Vec3& velocity_m_s);

Vec3 relative_velocity(const ConvexPoint& point, std::span<const Twist> twists);

// M (v - free) - J^T impulses, one per body.
void gradient(const ConvexContacts& problem, std::span<const Twist> twists,
              std::span<const PointResponse> responses, std::vector<Twist>& out);

// M + J^T G J / compliance in the pattern of `plan`.
void assemble(const ConvexContacts& problem, const Elimination& plan,
              std::span<const PointResponse> responses, std::vector<Block>& out);

}  // namespace soda::physics
