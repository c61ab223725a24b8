// One world's part in the solve of a giant island over several worlds, during one step.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "models/islands/solve_share.hpp"
#include "models/islands/split_messages.hpp"
#include "models/islands/split_plan.hpp"
#include "models/messages/schedule.hpp"
#include "physics/solvers/split_solver.hpp"

namespace soda::models {

// A giant island as a participating world knows it when the merge rounds are over.
struct SplitIsland {
  std::vector<physics::BodyId> ids;  // ascending
  std::vector<WorldId> owners;
  std::vector<physics::BodyState> states;
  std::vector<physics::ContactManifold> manifolds;  // canonical order
  std::shared_ptr<const physics::SceneDescription> scene;
  kernel::Bytes input;  // all of it but the owners, as key of shared solves
};

// A solver goes through rounds 0, 1, ... sweeps(): it hears in each but the first what the solvers
// beside it have said in the one before, and says what they have to hear. In the last one it tells
// all solvers the work of its impulses; in one more, which share all of them allow. Who is no
// solver waits for the outcome. Nothing is lost where what others have to say does not come: then
// each owner solves the whole.
class SplitSolve {
 public:
  struct Letter {
    WorldId to{};
    MessageKind kind{};
    kernel::Payload payload;
  };

  SplitSolve(SplitIsland island, SplitPlan plan, WorldId self);
  SplitSolve(const SplitSolve&) = delete;  // refers to itself
  SplitSolve& operator=(const SplitSolve&) = delete;

  const IslandName& name() const { return name_; }
  const SplitPlan& plan() const { return plan_; }
  const SplitIsland& island() const { return island_; }
  std::uint32_t sweeps() const;
  // Whether this world has blocks to solve and has heard all that it needed so far.
  bool solves() const { return range_ != nullptr && !gave_up_; }
  bool is_done() const { return outcome_ != nullptr; }
  // Has computed blocks in this execution of the step, not only repeated what it had said before.
  bool has_computed() const { return solver_ != nullptr; }

  // Whether the bag lacks what solvers have to hear in the next round; or news of how the blocks
  // ended that have a body of this world, after the last one.
  bool lacks_news(std::span<const kernel::MessageView> bag) const;
  bool lacks_outcome(std::span<const kernel::MessageView> bag) const;
  // One round; appends what it has to say for the next one. Repeats what it said in an execution
  // that heard the same, if `memory` has it; remembers there in the end. Gives up if the bag lacks
  // news.
  void round(std::int64_t step, std::uint32_t round, std::span<const kernel::MessageView> bag,
             SolveShare& memory, physics::StageCounters& counters, std::vector<Letter>& letters);
  // After the last round: for each other owner of bodies what it has to hear.
  std::vector<Letter> outcome_letters() const;

  // What the owner of `self`'s bodies has heard of the outcome: bodies as they ended, and the
  // report if it is this world's to make. Null if something is missing.
  struct Heard {
    std::vector<BlockNews::Moved> bodies;
    std::vector<physics::AdvanceFault> faults;
    std::optional<physics::IslandReport> report;
  };
  std::optional<Heard> outcome(std::span<const kernel::MessageView> bag) const;

  // Over what this world has heard and said: for checks.
  std::uint64_t digest() const;

 private:
  using Bag = std::span<const kernel::MessageView>;

  BlockNews news_for(WorldId world) const;
  std::optional<std::vector<physics::BorderBody>> hear(const SolverRange* from, Bag bag) const;
  std::optional<physics::StepWork> hear_work(Bag bag) const;
  void hear_borders(std::uint32_t round, Bag bag, physics::StageCounters& counters);
  void solve_stages(std::uint32_t stage, physics::StageCounters& counters);
  void say_borders(std::vector<Letter>& letters);
  void say_work(std::vector<Letter>& letters);
  void conclude(std::int64_t step, double share, SolveShare& memory,
                physics::StageCounters& counters);

  const SplitIsland island_;
  const SplitPlan plan_;
  const WorldId self_;
  IslandName name_;
  const SolverRange* range_ = nullptr;   // of this world
  const SolverRange* before_ = nullptr;  // of the solvers beside it
  const SolverRange* behind_ = nullptr;
  bool gave_up_ = false;
  std::unique_ptr<physics::BlockSolver> solver_;
  std::vector<SolvedBlocks::Stage> stages_;  // so far
  std::vector<physics::StepWork> work_;      // of its blocks, after the last of them
  std::shared_ptr<const SolvedBlocks> known_;
  std::shared_ptr<const SolvedBlocks> outcome_;
};

}  // namespace soda::models
