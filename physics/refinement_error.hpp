// How far steps of different lengths lead apart: the error of a step, as a length.
#pragma once

#include <span>
#include <vector>

#include "physics/body_state.hpp"
#include "physics/geometry.hpp"
#include "physics/scene.hpp"

namespace soda::physics {

// Of the bodies of an island, in the order of their ids.
struct BodySizes {
  double dt_s = 0.0;                      // the scene's step
  std::vector<double> radii_m, widths_m;  // of the bounding sphere; the smallest width
};
BodySizes sizes_of(const SceneDescription& scene, const Geometry& geometry,
                   std::span<const BodyId> ids);

// Velocities after each of some steps, those of all bodies after the first step first.
struct VelocityPath {
  std::vector<Vec3> linear, angular;
};

// Of a body's widths, what a point of it is off now, or after one more step of dt_s for the error
// of its velocities. The body (index) for which it is largest.
struct StepError {
  double widths = 0.0;
  std::size_t body = 0;
};
StepError larger(const StepError& a, const StepError& b);

// By how much velocities changed: a step is taken to be off by no more than that.
StepError change_of(const BodySizes& sizes, std::span<const BodyState> from,
                    std::span<const BodyState> to);

// What moved bodies besides their final velocities: push-out, mostly.
StepError displacement_of(const BodySizes& sizes, std::span<const BodyState> from,
                          std::span<const BodyState> to, double time_s);

// Of all velocity there is.
StepError speed_of(const BodySizes& sizes, std::span<const BodyState> states);

// Of two states that should be the same.
StepError difference_of(const BodySizes& sizes, std::span<const BodyState> a,
                        std::span<const BodyState> b);

// Of the extrapolation 2 T4 - T2 from what two and four steps lead to: a third of its difference
// from 2 T2 - T1, for it is four times as near.
StepError extrapolation_error(const BodySizes& sizes, std::span<const BodyState> one,
                              std::span<const BodyState> two, std::span<const BodyState> four);

// What the velocities deviate from a smooth course: a change within a step (from sliding to
// sticking, say), which all trials can see alike. The first step is compared over its three
// lengths, the later ones among each other. Times the quarter of time_s, in which it can have
// been.
StepError roughness(const BodySizes& sizes, std::span<const BodyState> from,
                    const VelocityPath& one, const VelocityPath& two, const VelocityPath& four,
                    double time_s);

// Twice the vector part of the rotation from `from` to `to`, for small ones.
Vec3 turn_between(const Quat& from, const Quat& to);

}  // namespace soda::physics
