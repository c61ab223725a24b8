// Which pairs of an island, and of it and statics, may meet within a step however they are hit.
#pragma once

#include <span>
#include <vector>

#include "physics/model/body_state.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/stage_counters.hpp"
#include "physics/shapes/geometry.hpp"

namespace soda::physics {

struct SweptPairs {
  std::vector<IndexPair> bodies;   // places among the ids, ascending
  std::vector<IndexPair> statics;  // a place and a static's index, sorted
};

// Each body as far as twice the fastest of them, and what gravity adds, can take it in dt_s, at
// twice its angular velocity: hits change who moves how.
SweptPairs query_swept_pairs(const SceneDescription& scene, const Geometry& geometry, double dt_s,
                             std::span<const BodyId> ids, std::span<const BodyState> states,
                             StageCounters& counters);

// The same as manifolds without points, in canonical order.
std::vector<ContactManifold> pairs_to_look_at(const SceneDescription& scene,
                                              const Geometry& geometry, double dt_s,
                                              std::span<const BodyId> ids,
                                              std::span<const BodyState> states,
                                              StageCounters& counters);

}  // namespace soda::physics
