// When two bodies in free flight touch: conservative advancement.
#pragma once

#include <optional>

#include "physics/model/contact_manifold.hpp"
#include "physics/narrowphase/separation.hpp"
#include "physics/shapes/geometry.hpp"

namespace soda::physics {

bool is_mesh(const SceneDescription& scene, BodyId id);

// As they are now: see separation_between(); no meshes. Of compounds, that of the parts that are
// nearest.
Separation separation_of(const PairStep& pair);

// By how much they overlap as they are now, >= 0.
double overlap_m(const PairStep& pair, StageCounters& counters);

// The gap below which two solids count as touching: of the size of rounding for spheres.
double touching_gap_m(const SceneDescription& scene, const Geometry& geometry, BodyId a,
                      const BodyState& state_a, BodyId b);

// Whether solids that come nearer by this in the time that is left come nearer at all: else no
// speed makes them approach, and no field presses them on each other. The width is that of the
// smaller.
inline bool is_approach(double nearer_m, double width_m) { return nearer_m > 1e-11 * width_m; }

struct Impact {
  double time_s = 0.0;
  // The solids touch and do not part for good, but do not approach either: they rest on each other,
  // roll or slide. No flight describes what follows.
  bool lasts = false;
};

// The first time within [0, dt_s] at which the two touch and approach each other, or from which
// they stay together. None of it: they do not touch. Solids that overlap at the start touch, and
// may part. A mesh touches on the front of its triangles only.
std::optional<Impact> time_of_impact(const PairStep& pair);

// The feature of the point that append_distance_to_impact() gives.
inline constexpr std::uint32_t kDistanceToImpact = 0x20000000u;

// Solids that move by more than their width within dt_s: if they meet, appends a manifold of one
// point with the place and normal of the impact, whose separation is the distance to it along that
// normal. Of a mesh, in its place among the manifolds of the pair, which end `out`; what of it has
// one of these is left out. Of compounds, one for each pair of parts that meet and have none.
void append_distance_to_impact(const PairStep& pair, std::vector<ContactManifold>& out);

}  // namespace soda::physics
