// A linkage that moves: RATTLE, one stage after the other.
#pragma once

#include <span>
#include <vector>

#include "physics/advance.hpp"
#include "physics/joint_rows.hpp"

namespace soda::physics {

// Gravity, drives, forces and damping over a time, at fixed poses.
void push_all(const SceneDescription& scene, double time_s, std::span<const BodyId> ids,
              std::span<const BodyState> states, std::span<SolverBody> bodies);

// What bounded rows and velocities that the joints do not allow did to the energy.
struct LinkageWork {
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
double swing_of(double force_newton, double arm_m, double mass_kg, const Mat3& inverse_inertia);

// Bodies that joints hold and nothing touches, at one time after the other.
class LinkageMotion {
 public:
  // `joints` is written to: afterwards its rows are those of some poses on the way.
  LinkageMotion(const SceneDescription& scene, std::span<const BodyId> ids, JointSystem& joints);
  LinkageMotion(const LinkageMotion&) = delete;
  LinkageMotion& operator=(const LinkageMotion&) = delete;

  // From these states on. Their velocities need not be allowed by the joints.
  void start(std::span<const BodyState> states);

  // Moves on by a time of any sign: half a kick, free rotation, half a kick (symmetric in time,
  // second order). Joints other than springs hold at its end, in place and in velocity. Adds to the
  // sums of `report`. False if the joints do not hold: then the states are of no use.
  bool advance(double time_s, IslandReport& report);

  // Velocities may be changed between stages.
  std::span<BodyState> states() { return states_; }
  std::span<const BodyState> states() const { return states_; }
  const JointSystem& joints() const { return *at_; }

  // Whether velocities go against the joints, as those that contacts left: then energy is lost.
  bool goes_against_joints();

  // How fast joints would swing a body about them, taut by what pushes the bodies for a time.
  double swing_rad_s(double time_s);
  bool is_afloat() const;  // nothing connects the bodies with the world

  // Of the last stage, by body.
  std::span<const KickChange> kick_changes() const { return kick_changes_; }

  LinkageWork work;  // of the stages so far

 private:
  void load_velocities();
  void drift(double time_s);
  bool hold_places(double time_s, double enough, IslandReport& report);
  void add_work(const JointSystem& joints);
  void correct(double time_s);
  void arrive(double time_s, double enough, IslandReport& report);

  const SceneDescription& scene_;
  std::span<const BodyId> ids_;
  bool sprung_ = false;
  std::vector<BodyState> states_, next_;
  JointSystem other_;
  JointSystem *at_, *end_;          // rows at states_ and at next_
  std::vector<SolverBody> bodies_;  // inertia as at states_
  std::vector<SolverBody> before_;  // a kick; with limits or motors only
  std::vector<KickChange> kick_changes_;
  // What each correction of the stage has shown: by how much it changed the errors, and what the
  // factors thought to be missing after it.
  struct Shown {
    std::vector<double> error_change, missed;
    double square = 0.0;  // of error_change
  };
  std::vector<Shown> shown_;
  std::size_t shown_count_ = 0;
  std::vector<double> error_;
  // The sum of those of the last stage, and its length (0: there was none).
  std::vector<double> corrected_, change_;
  double corrected_s_ = 0.0;
};

}  // namespace soda::physics
