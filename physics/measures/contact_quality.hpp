// How well the contacts of a step keep the laws of contact: a measure of committed states, which
// changes nothing.
#pragma once

#include <span>

#include "physics/model/body_state.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/scene.hpp"

namespace soda::physics {

// What each law is violated by at one point, all as speeds (m/s, >= 0). With n the normal, w the
// velocity at the step's end by which the gap opens beyond what may close in the step, j the normal
// impulse over the pair's reduced mass, f the friction impulse likewise, s the sliding velocity:
struct ContactResiduals {
  double signorini_m_s = 0.0;        // max(0, -w, -j): approach into the surface, or a pull
  double complementarity_m_s = 0.0;  // min(w, j) where both are > 0: a push across an open gap
  double cone_m_s = 0.0;             // max(0, |f| - mu j)
  double dissipation_m_s = 0.0;      // |s| + f . s / (mu j): what friction could still have braked
};

struct ContactQuality {
  ContactResiduals largest, sum;
  std::uint64_t points = 0;  // that carry an impulse or are violated

  double mean(double ContactResiduals::*law) const {
    return points > 0 ? sum.*law / static_cast<double>(points) : 0.0;
  }
};

// Adds the points of one step. `manifolds` are those found in `before`; `after` holds the
// velocities and impulses at the step's end; both by BodyId. Points of pairs that bounce obey
// another law and are left out.
void add_contacts(const SceneDescription& scene, std::span<const ContactManifold> manifolds,
                  std::span<const BodyState> before, std::span<const BodyState> after,
                  ContactQuality& quality);

}  // namespace soda::physics
