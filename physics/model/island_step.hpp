// What advances an island: what it is given, and what it writes besides the states.
#pragma once

#include <span>
#include <vector>

#include "physics/model/contact_manifold.hpp"
#include "physics/model/island_report.hpp"
#include "physics/model/scene.hpp"
#include "physics/model/stage_counters.hpp"

namespace soda::physics {

class Geometry;
struct SolveScratch;

// Bodies that contacts and joints connect, over a time > 0. Refers to what it is made of, none of
// which changes meanwhile; the states are passed beside it, states[i] those of ids[i].
struct IslandStep {
  const SceneDescription& scene;
  const Geometry& geometry;
  double dt_s = 0.0;
  std::span<const BodyId> ids;                 // ascending
  std::span<const ContactManifold> manifolds;  // canonical order, found over dt_s

  // The same bodies over another time, with the contacts that were found for it.
  IslandStep over(double time_s, std::span<const ContactManifold> found) const {
    return {scene, geometry, time_s, ids, found};
  }
};

// Over the scene's whole step.
inline IslandStep whole_step(const SceneDescription& scene, const Geometry& geometry,
                             std::span<const BodyId> ids,
                             std::span<const ContactManifold> manifolds) {
  return {scene, geometry, scene.dt_s, ids, manifolds};
}

// `scratch` is memory and holds nothing that counts; counters are added to, faults appended
// (speculative: nothing throws).
struct IslandEffects {
  SolveScratch& scratch;
  StageCounters& counters;
  std::vector<AdvanceFault>& faults;
};

}  // namespace soda::physics
