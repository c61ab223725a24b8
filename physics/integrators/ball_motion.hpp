// A body that a ball joint ties to the world, and nothing else acts on but its field: tops,
// pendulums.
#pragma once

#include <array>
#include <span>

#include "physics/integrators/articulated_motion.hpp"
#include "physics/model/island_report.hpp"

namespace soda::physics {

// The same motion as RattleMotion's but for rounding: three rows need no arrays.
class BallMotion final : public ArticulatedMotion {
 public:
  // The joint, if the island is such a body.
  static const Joint* joint_of(const SceneDescription& scene, std::span<const BodyId> ids,
                               const JointSystem& joints);

  BallMotion(const SceneDescription& scene, BodyId id, const Joint& joint);

  void start(std::span<const BodyState> states) override;
  bool advance(double time_s, IslandReport& report) override;
  std::span<BodyState> states() override { return {&state_, 1}; }
  bool goes_against_joints() override;
  double swing_rad_s(double time_s) override;
  bool is_isolated() const override { return false; }
  std::span<const KickChange> kick_changes() const override { return {&kick_change_, 1}; }

 private:
  // What an impulse at the anchor does, where the body is at some time.
  struct Hold {
    Vec3 arm = Vec3::Zero();  // from the centre to the anchor
    Mat3 inverse_inertia = Mat3::Zero();
    // L D L^T of the change of the anchor's velocity by an impulse: below the diagonal, inverse D.
    Vec3 lower = Vec3::Zero(), inverse_pivots = Vec3::Zero();

    Vec3 impulse_for(const Vec3& velocity) const;
  };
  struct Velocity {
    Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
  };
  // By how much a correction changed the error, and what the factors thought to be missing after.
  struct Shown {
    Vec3 error_change = Vec3::Zero(), missed = Vec3::Zero();
  };
  static constexpr int kMostCorrections = 20;

  Hold hold_at(const BodyState& state) const;
  void push(const Hold& hold, const Vec3& impulse_newton_s, Velocity& velocity) const;
  Vec3 stop(const Hold& hold, Velocity& velocity) const;
  Vec3 drift(double time_s, const Velocity& velocity);
  Mat3 correction_matrix(double time_s, const Velocity& velocity) const;
  bool hold_place(double time_s, double enough, Velocity& velocity, Vec3& impulse,
                  IslandReport& report);

  const SceneDescription& scene_;
  const BodyParams& body_;
  const Joint& joint_;
  double inverse_mass_ = 0.0;
  BodyState state_, next_;
  Hold hold_;  // at state_
  KickChange kick_change_;
  std::array<Shown, kMostCorrections> shown_;
  Vec3 corrected_ = Vec3::Zero();  // by the last stage, of length corrected_s_ (0: none)
  double corrected_s_ = 0.0;
};

}  // namespace soda::physics
