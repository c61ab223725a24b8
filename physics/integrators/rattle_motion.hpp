// The motion of any articulated island.
#pragma once

#include <span>
#include <vector>

#include "physics/integrators/articulated_motion.hpp"
#include "physics/math/solver_body.hpp"
#include "physics/model/island_report.hpp"

namespace soda::physics {

class RattleMotion final : public ArticulatedMotion {
 public:
  // `joints` is written to: afterwards its rows are those of some poses on the way.
  RattleMotion(const SceneDescription& scene, std::span<const BodyId> ids, JointSystem& joints);

  void start(std::span<const BodyState> states) override;
  bool advance(double time_s, IslandReport& report) override;
  std::span<BodyState> states() override { return states_; }
  bool goes_against_joints() override;
  double swing_rad_s(double time_s) override;
  bool is_isolated() const override;
  std::span<const KickChange> kick_changes() const override { return kick_changes_; }

 private:
  void load_velocities();
  void push(double time_s);
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
