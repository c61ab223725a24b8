// One world's part in the solve of a large island over several worlds, during one step.
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

// A large island as a participating world knows it when the merge rounds are over.
struct SplitIsland {
  std::vector<physics::BodyId> ids;  // ascending
  std::vector<WorldId> owners;
  std::vector<physics::BodyState> states;
  std::vector<physics::ContactManifold> manifolds;  // canonical order
  std::shared_ptr<const physics::SceneDescription> scene;
  kernel::Bytes input;  // all of it but the owners, as key of shared solves
};

// A solver goes through rounds 0, 1, ... iterations(): it receives in each but the first what the
// solvers beside it have sent in the one before, and sends what they need. In the last one it sends
// all solvers the work of its impulses; in one more, which share all of them allow. Who is no
// solver waits for the outcome. Nothing is lost where what others have to send does not come: then
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
  std::uint32_t iterations() const { return iterations_; }
  // Whether this world has blocks to solve and has received all that it needed so far.
  bool solves() const { return range_ != nullptr && !gave_up_; }
  bool is_done() const { return outcome_ != nullptr; }
  // Has computed blocks in this execution of the step, not only repeated what it had sent before.
  bool has_computed() const { return solver_ != nullptr; }

  // Whether the bag lacks what solvers have to receive in the next round; or news of how the blocks
  // ended that have a body of this world, after the last one.
  bool lacks_news(std::span<const kernel::MessageView> bag) const;
  bool lacks_outcome(std::span<const kernel::MessageView> bag) const;
  // One round; appends what it has to send for the next one. Repeats what it sent in an execution
  // that received the same, if `memory` has it; remembers there in the end. Gives up if the bag
  // lacks news.
  void round(std::int64_t step, std::uint32_t round, std::span<const kernel::MessageView> bag,
             SolveShare& memory, physics::StageCounters& counters, std::vector<Letter>& letters);
  // After the last round: for each other owner of bodies what it has to receive.
  std::vector<Letter> outcome_letters() const;

  // What the owner of `self`'s bodies has received of the outcome: bodies as they ended, and the
  // report if it is this world's to make. Null if something is missing.
  struct Received {
    std::vector<BlockNews::Moved> bodies;
    std::vector<physics::AdvanceFault> faults;
    std::optional<physics::IslandReport> report;
  };
  std::optional<Received> outcome(std::span<const kernel::MessageView> bag) const;

  // Over what this world has received and sent: for checks.
  std::uint64_t digest() const;

 private:
  using Bag = std::span<const kernel::MessageView>;

  BlockNews news_for(WorldId world) const;
  std::optional<std::vector<physics::BorderBody>> receive(const SolverRange* from, Bag bag) const;
  std::optional<physics::StepWork> receive_work(Bag bag) const;
  void receive_borders(std::uint32_t round, Bag bag, physics::StageCounters& counters);
  void solve_stages(std::uint32_t stage, physics::StageCounters& counters);
  void send_borders(std::vector<Letter>& letters);
  void send_work(std::vector<Letter>& letters);
  void conclude(std::int64_t step, double share, SolveShare& memory,
                physics::StageCounters& counters);

  const SplitIsland island_;
  const SplitPlan plan_;
  const WorldId self_;
  IslandName name_;
  const std::uint32_t iterations_;
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
