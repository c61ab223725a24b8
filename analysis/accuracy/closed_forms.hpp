// Textbook motions. All of them may use libm: they judge states, they do not make them.
#pragma once

#include <vector>

#include "analysis/accuracy/motion.hpp"
#include "physics/model/body_state.hpp"
#include "scenarios/known_answer.hpp"

namespace soda::analysis {

// A body with its constants, at time 0.
struct StartingBody {
  physics::BodyParams params;
  physics::BodyState state;
  double radius_m = 0.0;  // of spheres
};

// The slope of `Sliding` and `Rolling` in the world frame.
struct Slope {
  physics::Vec3 down, side, normal;  // unit, right-handed: down x side = normal
};
Slope slope_of(double slope_deg, double azimuth_deg);

MotionAt free_flight(const StartingBody& body, const physics::Vec3& gravity_m_s2);

// Way, velocity and acceleration along a line. What friction brings to a stop stays, or slides back
// down.
struct SlidingLaw {
  double speed_m_s = 0.0;          // at the start, down the slope
  double acceleration_m_s2 = 0.0;  // until it stops or turns
  bool turns = false;              // or stops
  bool stops = false;
  double stop_time_s = 0.0, stop_way_m = 0.0;  // or of the turn
  double after_m_s2 = 0.0;                     // acceleration from then on
};
SlidingLaw sliding_law(double speed_m_s, double gravity_m_s2, double slope_deg, double friction);
MotionAt sliding(const StartingBody& body, const Slope& slope, const SlidingLaw& law);

// A sphere; its spin must be about the slope's horizontal axis.
// With rolling friction it must roll from the start.
MotionAt rolling(const StartingBody& body, double gravity_m_s2, const scenarios::Rolling& answer);

// Bounces from rest or from a vertical velocity.
struct BouncingLaw {
  double gravity_m_s2 = 0.0, restitution = 0.0;
  double first_impact_s = 0.0, impact_speed_m_s = 0.0;

  double rest_time_s() const;         // of infinitely many bounces
  double apex_m(int bounce) const;    // height over the floor after this bounce, from 1
  double flight_s(int bounce) const;  // from this bounce to the next
};
BouncingLaw bouncing_law(const StartingBody& body, double gravity_m_s2, double restitution);
MotionAt bouncing(const StartingBody& body, const BouncingLaw& law);

// The motions of both, in their order.
std::vector<MotionAt> two_spheres(const StartingBody& a, const StartingBody& b,
                                  const physics::Vec3& gravity_m_s2, double restitution);

MotionAt floor_impact(const StartingBody& body, const scenarios::FloorImpact& answer);

// One motion for each body, in their order.
std::vector<MotionAt> sphere_line(const std::vector<StartingBody>& bodies);

}  // namespace soda::analysis
