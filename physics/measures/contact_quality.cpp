#include "physics/measures/contact_quality.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace soda::physics {
namespace {

// The pair of a manifold; a static has no mass, and perhaps a moving surface.
struct Pair {
  const BodyState* before_a = nullptr;
  const BodyState* before_b = nullptr;
  const BodyState* after_a = nullptr;
  const BodyState* after_b = nullptr;
  Vec3 surface_m_s = Vec3::Zero();
  double reduced_mass_kg = 0.0;
  double friction = 0.0, restitution = 0.0;
};

Pair pair_of(const SceneDescription& scene, const ContactManifold& m,
             std::span<const BodyState> before, std::span<const BodyState> after) {
  Pair pair;
  const BodyParams& a = scene.bodies[index_of(m.a)];
  pair.before_a = &before[index_of(m.a)];
  pair.after_a = &after[index_of(m.a)];
  pair.reduced_mass_kg = a.mass_kg;
  const Material* material = nullptr;
  if (is_static(m.b)) {
    const StaticBody& b = scene.statics[static_index_of(m.b)];
    material = &b.material;
    pair.surface_m_s = b.surface_velocity_m_s;
  } else {
    const BodyParams& b = scene.bodies[index_of(m.b)];
    material = &b.material;
    pair.before_b = &before[index_of(m.b)];
    pair.after_b = &after[index_of(m.b)];
    const auto inverse = [](const BodyParams& p) { return p.kinematic ? 0.0 : 1.0 / p.mass_kg; };
    pair.reduced_mass_kg = 1.0 / (inverse(a) + inverse(b));
  }
  pair.friction = std::sqrt(a.material.friction * material->friction);
  pair.restitution = std::max(a.material.restitution, material->restitution);
  return pair;
}

const ContactImpulse* impulse_of(const Pair& pair, const ContactManifold& m,
                                 std::uint32_t feature) {
  const std::vector<ContactImpulse>& stored = pair.after_a->impulses;
  const std::array<std::uint32_t, 3> key{index_of(m.b), m.part, feature};
  const auto at = std::lower_bound(
      stored.begin(), stored.end(), key, [](const ContactImpulse& i, const auto& wanted) {
        return std::array{index_of(i.other), i.part, i.feature} < wanted;
      });
  if (at == stored.end() || std::array{index_of(at->other), at->part, at->feature} != key)
    return nullptr;
  return &*at;
}

// Velocity of b against a at the point, at the step's end; arms are those of its start.
Vec3 relative_velocity(const Pair& pair, const Vec3& at) {
  const auto of = [&at](const BodyState& before, const BodyState& after) {
    return Vec3(after.linear_velocity_m_s +
                after.angular_velocity_rad_s.cross(at - before.position_m));
  };
  const Vec3 a = of(*pair.before_a, *pair.after_a);
  return pair.before_b ? Vec3(of(*pair.before_b, *pair.after_b) - a) : Vec3(-a);
}

ContactResiduals residuals_of(const Pair& pair, const ContactManifold& m, const ContactPoint& point,
                              double dt_s, const ContactImpulse* impulse) {
  // A point ahead lies midway in its gap; what a static stops is the body's surface.
  Vec3 at = point.position_m;
  if (pair.before_b == nullptr && point.separation_m > 0.0)
    at -= m.normal * (0.5 * point.separation_m);
  const Vec3 velocity = relative_velocity(pair, at);
  const double normal_m_s = velocity.dot(m.normal);
  const double opening = normal_m_s + std::max(point.separation_m, 0.0) / dt_s;
  const double push = impulse ? impulse->normal_newton_s / pair.reduced_mass_kg : 0.0;
  const Vec3 rub =
      impulse ? Vec3(impulse->friction_newton_s / pair.reduced_mass_kg) : Vec3(Vec3::Zero());
  ContactResiduals r;
  r.signorini_m_s = std::max({0.0, -opening, -push});
  r.complementarity_m_s = std::max(0.0, std::min(opening, push));
  r.cone_m_s = std::max(0.0, rub.norm() - pair.friction * push);
  if (pair.friction * push > 0.0) {
    Vec3 slide = velocity - m.normal * normal_m_s + pair.surface_m_s;
    slide -= m.normal * slide.dot(m.normal);
    r.dissipation_m_s = std::max(0.0, slide.norm() + rub.dot(slide) / (pair.friction * push));
  }
  return r;
}

}  // namespace

void add_contacts(const SceneDescription& scene, std::span<const ContactManifold> manifolds,
                  std::span<const BodyState> before, std::span<const BodyState> after,
                  ContactQuality& quality) {
  constexpr std::array kLaws{&ContactResiduals::signorini_m_s,
                             &ContactResiduals::complementarity_m_s, &ContactResiduals::cone_m_s,
                             &ContactResiduals::dissipation_m_s};
  for (const ContactManifold& m : manifolds) {
    if (is_joint(m)) continue;
    const Pair pair = pair_of(scene, m, before, after);
    if (pair.restitution > 0.0) continue;
    for (std::uint32_t i = 0; i < m.count; ++i) {
      const ContactImpulse* impulse = impulse_of(pair, m, m.points[i].feature);
      const ContactResiduals r = residuals_of(pair, m, m.points[i], scene.dt_s, impulse);
      const bool counts = (impulse && impulse->normal_newton_s != 0.0) || r.signorini_m_s > 0.0;
      if (!counts) continue;
      ++quality.points;
      for (const auto law : kLaws) {
        quality.largest.*law = std::max(quality.largest.*law, r.*law);
        quality.sum.*law += r.*law;
      }
    }
  }
}

}  // namespace soda::physics
