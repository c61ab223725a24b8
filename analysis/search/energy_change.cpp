#include "analysis/search/energy_change.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace soda::analysis {

using namespace physics;

namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

double spin_energy(const BodyParams& params, const BodyState& state) {
  const Vec3 spin = state.orientation.conjugate() * state.angular_velocity_rad_s;
  return 0.5 * spin.dot(params.inertia_local_kg_m2 * spin);
}

}  // namespace

double speed_rounding_m_s(double fastest_m_s, std::size_t points) {
  return kEpsilon * fastest_m_s * static_cast<double>(1 + points);
}

void add_change(const SceneDescription& scene, BodyId id, double rounding_m_s,
                const BodyState& before, const BodyState& after, EnergyChange& change) {
  const BodyParams& params = scene.bodies[index_of(id)];
  const double m = params.mass_kg, g = scene.gravity_m_s2.norm();
  const Vec3 &v0 = before.linear_velocity_m_s, &v1 = after.linear_velocity_m_s;
  const double lifted = -m * scene.gravity_m_s2.dot(after.position_m - before.position_m);
  const double spin0 = spin_energy(params, before), spin1 = spin_energy(params, after);
  change.gain_joule += 0.5 * m * (v1 - v0).dot(v1 + v0) + (spin1 - spin0) + lifted;
  change.scale_joule += 0.5 * m * (v0.squaredNorm() + v1.squaredNorm()) + spin0 + spin1 +
                        std::abs(lifted) + m * g * g * scene.dt_s * scene.dt_s;
  change.scale_joule += m * g * before.position_m.norm() * (8.0 * kEpsilon / kEnergyRounding);
  change.scale_joule += m * rounding_m_s * rounding_m_s / kEnergyRounding;
}

void add_elastic(const SceneDescription& scene, std::span<const BodyState> before,
                 std::span<const BodyState> after, BodyId id, EnergyChange& change) {
  for (const Joint& joint : scene.joints) {
    if (joint.kind != JointKind::kSpring || joint.a != id) continue;
    double far_m = 0.0;
    const auto stretch = [&](std::span<const BodyState> states) {
      const auto end = [&](BodyId body, const Vec3& anchor) -> Vec3 {
        if (body == kWorldBody) return anchor;
        const BodyState& state = states[index_of(body)];
        return state.position_m + state.orientation * anchor;
      };
      const Vec3 a = end(joint.a, joint.anchor_a_m), b = end(joint.b, joint.anchor_b_m);
      far_m = std::max(far_m, a.norm() + b.norm());
      return (b - a).norm() - joint.length_m;
    };
    const double from = stretch(before), to = stretch(after), k = joint.stiffness_newton_m;
    change.gain_joule += 0.5 * k * (to - from) * (to + from);
    change.scale_joule += 0.5 * k * (from * from + to * to);
    const double rounding_m = 4.0 * kEpsilon * far_m;
    change.scale_joule +=
        k * rounding_m * (std::abs(from) + std::abs(to) + rounding_m) / kEnergyRounding;
  }
}

}  // namespace soda::analysis
