// What a step changes of the energy of bodies and springs, against how exactly that can be known.
#pragma once

#include <cstddef>
#include <span>

#include "physics/model/body_state.hpp"
#include "physics/model/scene.hpp"

namespace soda::analysis {

inline constexpr double kEnergyRounding = 1e-9;  // of the scale

struct EnergyChange {
  double gain_joule = 0.0;
  double scale_joule = 0.0;
};

// Speeds below the rounding of the fastest that there was are no motion: impulses that took it away
// are where the next step starts from. Each of `points` contacts adds its impulse to a velocity,
// and each sum is off by half an epsilon in each component: sqrt(3) / 2 points epsilon of the
// fastest.
double speed_rounding_m_s(double fastest_m_s, std::size_t points);

// Of one body over a step. Speeds are known to `rounding_m_s`. Positions count by their difference:
// far from the origin as near it.
void add_change(const physics::SceneDescription& scene, physics::BodyId id, double rounding_m_s,
                const physics::BodyState& before, const physics::BodyState& after,
                EnergyChange& change);

// What springs of an island hold more after a step. Lengths are known to the rounding of places.
void add_elastic(const physics::SceneDescription& scene, std::span<const physics::BodyState> before,
                 std::span<const physics::BodyState> after, physics::BodyId id,
                 EnergyChange& change);

}  // namespace soda::analysis
