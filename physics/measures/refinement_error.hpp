// How far steps of different lengths lead apart: the error of a step, as a length.
#pragma once

#include <span>
#include <vector>

#include "physics/math/short_list.hpp"
#include "physics/model/body_state.hpp"
#include "physics/model/scene.hpp"
#include "physics/shapes/geometry.hpp"

namespace soda::physics {

// Of the bodies of an island, in the order of their ids.
struct BodySize {
  double radius_m = 0.0, width_m = 0.0;  // of the bounding sphere; the smallest one
};
struct BodySizes {
  double dt_s = 0.0;  // the scene's step
  ShortList<BodySize, 2> bodies;
};
BodySizes sizes_of(const SceneDescription& scene, const Geometry& geometry,
                   std::span<const BodyId> ids);

// Velocities after each of some steps, those of all bodies after the first step first.
struct BodyVelocity {
  Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
};
using VelocityPath = ShortList<BodyVelocity, 4>;

// Of a body's widths, what a point of it is off now, or after one more step of dt_s for the error
// of its velocities. The body (index) for which it is largest.
struct StepError {
  double relative_error = 0.0;
  std::size_t body = 0;
};
StepError larger(const StepError& a, const StepError& b);

// By how much velocities changed: a step is taken to be off by no more than that.
StepError change_of(const BodySizes& sizes, std::span<const BodyState> from,
                    std::span<const BodyState> to);

// What moved bodies besides their final velocities: position correction, mostly.
StepError displacement_of(const BodySizes& sizes, std::span<const BodyState> from,
                          std::span<const BodyState> to, double time_s);

// Of all velocity there is.
StepError speed_of(const BodySizes& sizes, std::span<const BodyState> states);

// What parts two states of a body. Rotations are twice the vector part of the quaternion.
struct BodyDifference {
  Vec3 place_m = Vec3::Zero(), rotation_rad = Vec3::Zero();
  Vec3 velocity_m_s = Vec3::Zero(), angular_velocity_rad_s = Vec3::Zero();
};
BodyDifference difference_of(const BodyState& from, const BodyState& to);

// What parts them, of all bodies.
StepError apart_of(const BodySizes& sizes, std::span<const BodyState> from,
                   std::span<const BodyState> to);

// Of differences that should be none.
StepError largest_of(const BodySizes& sizes, std::span<const BodyDifference> differences);

// Of differences that should be the same.
StepError apart_of(const BodySizes& sizes, std::span<const BodyDifference> a,
                   std::span<const BodyDifference> b);

// What the velocities deviate from a smooth course: a change within a step (from sliding to
// sticking, say), which all trials can see alike. The first step is compared over its three
// lengths, the later ones among each other. Times the quarter of time_s, in which it can have
// been.
StepError roughness_indicator(const BodySizes& sizes, std::span<const BodyState> from,
                              const VelocityPath& one, const VelocityPath& two,
                              const VelocityPath& four, double time_s);

// What one and two steps over time_s are off from steady forces, under which both have velocities
// on one line and differ by what displacements of first order must: 0 if twice the second less the
// first is exact. `two`: velocities after each of its steps.
StepError unsteadiness_indicator(const BodySizes& sizes, std::span<const BodyState> from,
                                 std::span<const BodyState> after_one,
                                 std::span<const BodyState> after_two, const VelocityPath& two,
                                 double time_s);

// By how much velocities after two equal steps are off the line of those before.
StepError bend_indicator(const BodySizes& sizes, std::span<const BodyState> from,
                         const VelocityPath& two);

// Where in time_s > 0 forces on a single body change abruptly, as a share of that time, if its
// velocities were on one line from `before` on, past_s ago, and are on another one after the
// middle: where the two cross. .5 if they do not in the first half, or past_s is 0.
double share_before_bend(const BodySizes& sizes, std::span<const BodyState> before, double past_s,
                         std::span<const BodyState> from, const VelocityPath& two, double time_s);

}  // namespace soda::physics
