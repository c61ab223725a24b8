// How an articulated island moves, one stage after the other.
#pragma once

#include <span>

#include "physics/constraints/joint_rows.hpp"
#include "physics/model/island_report.hpp"

namespace soda::physics {

// What bounded rows and velocities that the joints do not allow did to the energy.
struct ArticulatedWork {
  double motors_joule = 0.0;
  bool loses = false;  // a limit has pushed, or started to
};

// How far apart the two kicks of a stage were, of a body.
struct KickChange {
  Vec3 linear_m_s = Vec3::Zero(), angular_rad_s = Vec3::Zero();
};

// A joint under tension is a stiff spring for what turns across it: of a body that is held at an
// arm with a force, the square of the rate, 1/s^2. The explicit step is stable up to twice its
// inverse, and accurate well below.
inline double swing_of(double force_newton, double arm_m, double mass_kg,
                       const Mat3& inverse_inertia) {
  return force_newton * arm_m / (1.0 / inverse_inertia.norm() + mass_kg * arm_m * arm_m);
}

// Bodies that joints hold and nothing touches, at one time after the other (RATTLE).
class ArticulatedMotion {
 public:
  ArticulatedMotion() = default;
  ArticulatedMotion(const ArticulatedMotion&) = delete;
  ArticulatedMotion& operator=(const ArticulatedMotion&) = delete;
  virtual ~ArticulatedMotion() = default;

  // From these states on. Their velocities need not be allowed by the joints.
  virtual void start(std::span<const BodyState> states) = 0;

  // Moves on by a time of any sign: half a kick, free rotation, half a kick (symmetric in time,
  // second order). Joints other than springs hold at its end, in place and in velocity. Adds to the
  // sums of `report`. False if the joints do not hold: then the states are of no use.
  virtual bool advance(double time_s, IslandReport& report) = 0;

  // Velocities may be changed between stages.
  virtual std::span<BodyState> states() = 0;

  // Whether velocities go against the joints, as those that contacts left: then energy is lost.
  virtual bool goes_against_joints() = 0;

  // How fast joints would swing a body about them, taut by what pushes the bodies for a time.
  virtual double swing_rad_s(double time_s) = 0;

  virtual bool is_isolated() const = 0;  // nothing connects the bodies with the world

  // Of the last stage, by body.
  virtual std::span<const KickChange> kick_changes() const = 0;

  ArticulatedWork work;  // of the stages so far
};

}  // namespace soda::physics
