#include "physics/solvers/convex_turning.hpp"

#include <algorithm>
#include <cmath>

#include "physics/solvers/convex_contacts.hpp"

namespace soda::physics {

Vec3 relative_velocity(const ConvexTurning& turning, std::span<const Twist> twists) {
  Vec3 rad_s = -twists[turning.a].angular;
  if (turning.b < twists.size()) rad_s += twists[turning.b].angular;
  return rad_s * turning.gyration_m;
}

TurningResponse bounded(const ConvexTurning& turning, double pressing_newton_s,
                        const Vec3& wanted) {
  TurningResponse out;
  out.wanted_newton_s = wanted;
  const double about = wanted.dot(turning.normal);
  const Vec3 plane = wanted - turning.normal * about;
  const double most_about = turning.torsional * pressing_newton_s;
  out.spin_held = std::abs(about) < most_about;
  out.impulse_newton_s = turning.normal * std::clamp(about, -most_about, most_about);
  const double most = turning.rolling * pressing_newton_s;
  const double size = plane.norm();
  if (size < most) {
    out.rolls_held = true;
    out.impulse_newton_s += plane;
  } else if (most > 0.0) {
    out.along = plane * (1.0 / size);
    out.aside = most / size;
    out.impulse_newton_s += out.along * most;
  }
  return out;
}

TurningResponse respond(const ConvexTurning& turning, double stiffness_kg,
                        const Vec3& velocity_m_s) {
  return bounded(turning, turning.pressing_newton_s,
                 turning.start_newton_s - velocity_m_s * stiffness_kg);
}

double pressing(const ConvexTurning& turning, std::span<const ConvexPoint> points,
                std::span<const PointResponse> responses) {
  double sum = 0.0;
  for (std::uint32_t i = turning.first_point; i < turning.first_point + turning.points; ++i)
    sum += responses[i].impulse_newton_s.dot(points[i].normal);
  return std::max(sum, 0.0);
}

}  // namespace soda::physics
