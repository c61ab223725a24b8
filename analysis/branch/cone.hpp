// A branch computed where it differs: the cone of influence of new inputs in a recorded run.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "analysis/branch/branch_difference.hpp"
#include "analysis/branch/recorded_bodies.hpp"
#include "physics/step/stepper.hpp"
#include "scenarios/scenario.hpp"

namespace soda::analysis {

// A step is a function of states, and an island's of its own bodies' alone. So a body that is as
// recorded stays so as long as no other comes near it that is not: only those that are not, and who
// may come to touch them, directly or over others, are advanced anew. They end up bit for bit as in
// a run of all bodies, if in a step nobody gets farther beyond what is foreseen and what was
// recorded than twice the fastest can (as query_swept_pairs() of physics supposes, too).
class Cone {
 public:
  // `scenario` as resumed_without_states() gives it, with the new inputs among its script. Both
  // must outlive this object.
  Cone(LogReader& log, const scenarios::Scenario& scenario);

  // One step on, no farther than the log. False: the log does not tell where bodies are, or the
  // cone is so large that a run of all bodies takes less; nothing can be asked any more. Throws
  // NumericalFailure, and FileError for what no run can have recorded.
  bool advance();
  // The last step that was made.
  std::int64_t step() const { return step_; }
  StepDifference difference();
  // How many bodies were advanced, over all steps.
  std::uint64_t body_steps() const { return body_steps_; }
  // Of all bodies. Reads their recorded states.
  std::uint64_t digest();

 private:
  // A body that is not as recorded, when a step begins; no state: it is not there.
  using State = std::optional<physics::BodyState>;
  // A body that is advanced.
  struct Member {
    State start, end;
    bool is_looked_at = false;  // who is near it is a member
  };
  // Who may be near a box for as long as the bounds hold.
  struct Near {
    physics::Aabb box;
    std::vector<physics::BodyId> bodies;
  };

  void take_inputs(std::span<const models::CommittedInput> recorded);
  void note_new(const models::UserInput& input);
  void add_member(physics::BodyId id);
  void gather();
  void run();
  bool add_those_near(physics::BodyId id, physics::Aabb box);
  const std::vector<physics::BodyId>& near(physics::BodyId id, const physics::Aabb& box);
  bool reaches_others();
  void keep_what_differs();

  LogReader& log_;
  physics::SceneDescription scene_;
  const physics::Geometry geometry_;
  RecordedBodies recorded_;
  physics::Stepper stepper_;
  models::Presence presence_;
  std::vector<models::UserInput> script_;  // in the order of acting
  std::size_t next_input_ = 0;
  std::int64_t step_ = 0;
  std::map<physics::BodyId, State> differing_;
  std::set<physics::BodyId> changed_;  // by a constant of theirs: they never count as recorded
  BranchDifference difference_;

  // Of one step.
  std::vector<models::UserInput> acting_;  // on bodies
  std::map<physics::BodyId, Member> members_;
  double slack_m_ = 0.0;
  // Of the steps with the same bounds.
  std::map<physics::BodyId, Near> near_;
  std::int64_t near_until_ = -1;
  std::uint64_t body_steps_ = 0, work_ = 0, most_work_ = 0;  // in bodies advanced
};

}  // namespace soda::analysis
