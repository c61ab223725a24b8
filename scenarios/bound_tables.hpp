// The tables of bounds on measures of error, and how a kind of reference takes them in.
#pragma once

#include "scenarios/field_binding.hpp"
#include "scenarios/format_limits.hpp"
#include "scenarios/reference_tables.hpp"

namespace soda::scenarios {

extern const ObjectTable kMotionBounds, kSlidingBounds, kBounceBounds, kRestBounds,
    kInvariantBounds, kStackBounds, kSideBounds, kPileBounds, kGasBounds, kChainBounds,
    kJointBounds;

// The fields of a kind of reference: its own, then its bounds.
template <class Spec, std::size_t N>
constexpr std::array<Field, N + 2> with_bounds(const std::array<Field, N>& own,
                                               const ObjectTable& bounds) {
  std::array<Field, N + 2> all{};
  for (std::size_t i = 0; i < N; ++i) all[i] = own[i];
  all[N] =
      object_field<Spec, &Spec::must>("must", kOptional, kNone, bounds, "What has to be reached.");
  all[N + 1] = object_field<Spec, &Spec::stretch>("stretch", kOptional, kNone, bounds,
                                                  "What the mathematics allows.");
  return all;
}

template <class Spec>
constexpr Field body_field() {
  return field<Spec, &Spec::body>("body", kRequired, kId, "Id of a body of the scene.");
}

}  // namespace soda::scenarios
