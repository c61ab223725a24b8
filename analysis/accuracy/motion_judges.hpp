// Judges of single bodies whose motion is known at every time.
#pragma once

#include "analysis/accuracy/closed_forms.hpp"
#include "analysis/accuracy/judge.hpp"

namespace soda::analysis {

// The body with this label, at the start. The label must exist (the reader has checked it).
physics::BodyId id_of_label(const scenarios::Scenario& scenario, std::int64_t label);
StartingBody starting_body(const scenarios::Scenario& scenario, physics::BodyId id);

// A body, how it should move, and the worst that was seen.
class MotionTrack {
 public:
  MotionTrack(physics::BodyId body, MotionAt exact) : body_(body), exact_(std::move(exact)) {}
  void see(double time_s, std::span<const physics::BodyState> states);
  // The largest of all tracks, of what the closed form tells.
  static std::vector<Measured> worst(std::span<const MotionTrack> tracks);

 private:
  physics::BodyId body_;
  MotionAt exact_;
  double position_m_ = 0.0, end_position_m_ = 0.0, velocity_m_s_ = 0.0, end_velocity_m_s_ = 0.0,
         end_spin_rad_s_ = 0.0, attitude_rad_ = 0.0, spin_rad_s_ = 0.0;
  bool turns_ = false;
};

// Angle between two orientations, exact for small ones.
double angle_between(const physics::Quat& a, const physics::Quat& b);

std::unique_ptr<Judge> judge_motions(std::vector<MotionTrack> tracks);
// The same with the energy and the angular momentum of the body.
std::unique_ptr<Judge> judge_torque_free(const StartingBody& body, physics::BodyId id);
std::unique_ptr<Judge> judge_sliding(const scenarios::Scenario& scenario,
                                     const scenarios::Sliding& answer);
std::unique_ptr<Judge> judge_bouncing(const scenarios::Scenario& scenario,
                                      const scenarios::Bouncing& answer, double dt_s,
                                      double duration_s);

}  // namespace soda::analysis
