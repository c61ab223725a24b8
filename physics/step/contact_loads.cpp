#include "physics/step/contact_loads.hpp"

#include <algorithm>

#include "physics/step/step.hpp"

namespace soda::physics {
namespace {

// The manifold that the impulse belongs to, and its point there; null if there is none by now.
struct Found {
  const ContactManifold* manifold = nullptr;
  const ContactPoint* point = nullptr;
};

Found find_point(std::span<const ContactManifold> manifolds, BodyId a,
                 const ContactImpulse& impulse) {
  ContactManifold wanted;
  wanted.a = a;
  wanted.b = impulse.other;
  wanted.part = impulse.part;
  const auto at = std::ranges::lower_bound(manifolds, wanted, canonical_before);
  if (at == manifolds.end() || canonical_before(wanted, *at)) return {};
  for (std::uint32_t i = 0; i < at->count; ++i)
    if (at->points[i].feature == impulse.feature) return {&*at, &at->points[i]};
  return {};
}

}  // namespace

std::vector<ContactLoad> contact_loads(const SceneDescription& scene, const Geometry& geometry,
                                       std::span<const BodyId> ids,
                                       std::span<const BodyState> states) {
  StepScratch scratch;
  StageCounters counters;
  find_contacts_alone(scene, geometry, ids, states, scratch, counters);
  std::vector<ContactLoad> loads;
  for (std::size_t i = 0; i < ids.size(); ++i)
    for (const ContactImpulse& impulse : states[i].impulses) {
      if (impulse.part >= kFirstJointPart) continue;
      const auto [manifold, point] = find_point(scratch.manifolds, ids[i], impulse);
      ContactLoad& load = loads.emplace_back();
      load.a = ids[i];
      load.b = impulse.other;
      load.normal_newton = impulse.normal_newton_s / scene.dt_s;
      load.friction_newton = impulse.friction_newton_s / scene.dt_s;
      if (point == nullptr) continue;
      load.point = *point;
      load.normal = manifold->normal;
    }
  return loads;
}

}  // namespace soda::physics
