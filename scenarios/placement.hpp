// Places without overlap for many equal spheres.
#pragma once

#include <span>
#include <vector>

#include "physics/model/ids.hpp"
#include "scenarios/random.hpp"

namespace soda::scenarios {

struct BoundingSphere {
  physics::Vec3 center_m = physics::Vec3::Zero();
  double radius_m = 0.0;
};

// Draws `count` centres one after the other, uniformly in `region`, each anew until its sphere is
// at least gap_m away from the others and from `obstacles`. Returns fewer than `count` if one was
// drawn kMaxDraws times in vain: the region is full.
inline constexpr int kMaxDraws = 2000;
std::vector<physics::Vec3> place_spheres(std::size_t count, double radius_m, double gap_m,
                                         const physics::Aabb& region,
                                         std::span<const BoundingSphere> obstacles,
                                         RandomStream& stream);

}  // namespace soda::scenarios
