// Contacts between two bodies.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "physics/model/ids.hpp"

namespace soda::physics {

struct ContactPoint {
  Vec3 position_m = Vec3::Zero();  // world frame, midway between the surfaces
  double separation_m = 0.0;       // < 0: penetrating
  std::uint32_t feature = 0;       // which features touch; stable while the bodies rest
};

// Up to four points that share one normal. A pair with a mesh may have several manifolds, told
// apart by `part`. Canonical order: by (a, b, part), points by feature.
struct ContactManifold {
  BodyId a{};  // the lower id, always dynamic
  BodyId b{};
  std::uint32_t part = 0;
  std::uint32_t count = 0;      // 1 .. 4; 0: it only connects
  Vec3 normal = Vec3::UnitZ();  // unit, from a to b
  std::array<ContactPoint, 4> points;
  // Of solids that are not near, but meet within the step, and part at once: when. Else 0.
  double impact_s = 0.0;
};

// Of its points; 1e300 without any.
inline double least_separation_m(const ContactManifold& m) {
  double least = 1e300;
  for (std::uint32_t i = 0; i < m.count; ++i) least = std::min(least, m.points[i].separation_m);
  return least;
}

// It only connects its bodies.
inline bool is_link(const ContactManifold& m) { return m.count == 0; }

// The order of contacts wherever it matters: (a, b, part).
inline bool canonical_before(const ContactManifold& x, const ContactManifold& y) {
  if (x.a != y.a) return x.a < y.a;
  return x.b != y.b ? x.b < y.b : x.part < y.part;
}

}  // namespace soda::physics
