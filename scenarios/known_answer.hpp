// What is known of a scene beforehand: closed forms by name, and how near a run must come to them.
// The layer above judges runs by it; nothing below knows it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "physics/model/body_state.hpp"

namespace soda::scenarios {

// Initial positions, velocities, masses and gravity are those of the scene; what stands here is
// what it does not say, or says in a form that would have to be derived. `body` is a label.

// x0 + v0 t + g t^2 / 2, with constant spin where the inertia allows it.
struct FreeFlight {
  std::int64_t body = -1;
};
// Euler's equations without torque, attitude included, for any three principal moments.
struct TorqueFree {
  std::int64_t body = -1;
};
// A box that slides on a slope through its initial position. `azimuth_deg`: of the downward
// direction, from the x axis about z. Starts at rest or along the slope line.
struct Sliding {
  std::int64_t body = -1;
  double slope_deg = 0.0, azimuth_deg = 0.0;
  double friction = 0.0;  // of the pair
};
// A sphere on such a slope: slides until it rolls, if friction is enough for that. With rolling
// friction it rolls from the start; it stops, and rests or turns back.
struct Rolling {
  std::int64_t body = -1;
  double slope_deg = 0.0, azimuth_deg = 0.0;
  double friction = 0.0;
  double rolling_friction_m = 0.0;  // of the pair
};
// A sphere that falls on a level floor at z = 0 and bounces, until it rests.
struct Bouncing {
  std::int64_t body = -1;
  double restitution = 0.0;  // in (0, 1)
};
// Two spheres without friction that meet once.
struct TwoSpheres {
  std::int64_t body = -1, other = -1;
  double restitution = 0.0;
};
// A spinning sphere that hits a level floor at z = 0 once, without gravity.
struct FloorImpact {
  std::int64_t body = -1;
  double friction = 0.0, restitution = 0.0;
};
// All bodies: equal spheres on a line along x that pass their velocities on (e = 1).
struct SphereLine {};
// All bodies: boxes in a row along x on a level floor, which slide along x and hit each other.
struct SlidingRow {
  double friction = 0.0;     // of each with the floor
  double restitution = 0.0;  // of each with the next
};
// All bodies stay as they are.
struct AtRest {};
// Energy and momenta of all bodies keep their values, whatever happens.
struct Conserved {};
// A vertical stack of all bodies by label: each contact carries the weight above it.
struct StackForces {};
// No body's centre passes to the far side of a plane, the side to which `normal` points.
struct OneSide {
  physics::Vec3 normal = physics::Vec3::UnitX();
  double offset_m = 0.0;
};
// Bodies that start inside each other come apart.
struct Separation {};
// How deep bodies overlap, and no energy out of nothing. For piles, which have no pointwise truth.
struct Pile {};
// After the run all velocities are reversed and it runs again: the start must come back.
struct Reversal {};
// Equal elastic spheres in a closed box: the pressure that follows from their energy, and the
// spread of their velocities.
struct HardSphereGas {
  physics::Vec3 size_m = physics::Vec3::Zero();  // of the box inside
};
// Gravity, constant forces and torque, and damping, as the file has them for the body. The attitude
// is known where the spin stays about one principal axis; a force of the body's frame must not
// turn.
struct ForcedFlight {
  std::int64_t body = -1;
};
// A body whose one joint is a spring between its centre and the world; moves along that line. With
// friction, it slides on a level floor, and the spring's damping lets it swing.
struct DampedOscillator {
  std::int64_t body = -1;
  double friction = 0.0;
};
// A heavy symmetric top, whose one joint is a ball with the world on its axis of symmetry, in
// steady precession: it keeps its angle to gravity.
struct SteadyPrecession {
  std::int64_t body = -1;
  double precession_rad_s = 0.0;  // about the upward vertical
};
// A body whose one joint is a slider or hinge with the world: motor, stops and, along a slider,
// gravity. Nothing else acts about a hinge.
struct JointTravel {
  std::int64_t body = -1;
};
// All bodies by label, downwards from the world's joint: each joint carries the weight below it.
struct HangingChain {};
// No joint comes apart.
struct JointsHold {};
// The state that a far more accurate run of this program ended in.
struct StoredRun {
  struct End {
    std::int64_t body = -1;
    physics::Vec3 position_m = physics::Vec3::Zero();
    physics::Quat orientation = physics::Quat::Identity();
  };
  std::vector<End> ends;
  double error_m = 0.0;  // of the stored positions, by its own convergence
};

using KnownAnswer =
    std::variant<FreeFlight, TorqueFree, Sliding, Rolling, Bouncing, TwoSpheres, FloorImpact,
                 SphereLine, SlidingRow, AtRest, Conserved, StackForces, OneSide, Separation, Pile,
                 Reversal, HardSphereGas, ForcedFlight, DampedOscillator, SteadyPrecession,
                 JointTravel, HangingChain, JointsHold, StoredRun>;

// How large one measure of error may be.
struct Bound {
  std::string measure;            // its key in the file, e.g. position_m
  std::optional<double> must;     // what has to be reached
  std::optional<double> stretch;  // what mathematics allows
};

struct Reference {
  std::string form;  // name of the closed form in the file
  KnownAnswer answer;
  std::vector<Bound> bounds;  // in the order of the format's table
};

}  // namespace soda::scenarios
