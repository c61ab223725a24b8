// Rolling and torsional friction in the convex problem (convex_contacts.hpp): what a contact does
// against rotations of its two bodies. As velocities of a point one radius of gyration away, so
// that compliances, errors and impulses are those of points. Its impulse lies in a cylinder: in
// the contact plane in a disc, along the normal in an interval, both as large as what presses
// allows. `pressing_newton_s` is held within a minimisation, and corrected as start impulses are.
#pragma once

#include <cstdint>
#include <span>

#include "physics/model/ids.hpp"

namespace soda::physics {

struct ConvexPoint;
struct PointResponse;
struct Twist;

struct ConvexTurning {
  std::uint32_t a = 0, b = 0;                 // those of its points
  std::uint32_t first_point = 0, points = 0;  // that press
  Vec3 normal = Vec3::Zero();
  double gyration_m = 0.0;
  double rolling = 0.0, torsional = 0.0;  // coefficients, in gyrations
  double pressing_newton_s = 0.0;
  Vec3 start_newton_s = Vec3::Zero();  // torque impulse on b, over the radius
};

struct TurningResponse {
  Vec3 wanted_newton_s = Vec3::Zero();  // without bounds
  Vec3 impulse_newton_s = Vec3::Zero();
  Vec3 along = Vec3::Zero();  // unit, in the contact plane, where the disc ends
  double aside = 0.0;         // in [0, 1]: how it answers across `along`
  bool rolls_held = false;    // in the contact plane
  bool spin_held = false;     // about the normal

  bool is_bounded_as(const TurningResponse& other) const {
    return rolls_held == other.rolls_held && spin_held == other.spin_held;
  }
  // What rolls answers differently with each direction.
  bool turns_along() const { return aside > 0.0; }
};

// Of b against a, times the radius.
Vec3 relative_velocity(const ConvexTurning& turning, std::span<const Twist> twists);

// What is wanted, as far as it may be.
TurningResponse bounded(const ConvexTurning& turning, double pressing_newton_s, const Vec3& wanted);
TurningResponse respond(const ConvexTurning& turning, double stiffness_kg,
                        const Vec3& velocity_m_s);

// The sum of the normal impulses of its points.
double pressing(const ConvexTurning& turning, std::span<const ConvexPoint> points,
                std::span<const PointResponse> responses);

}  // namespace soda::physics
