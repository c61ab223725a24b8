// Extrapolated ghosts of a world: what stands in for ghosts that it has not received yet.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "models/ghosts/extrapolated_ghosts.hpp"
#include "models/ghosts/extrapolation_audit.hpp"
#include "models/world/step_in_progress.hpp"

namespace soda::models {

// The ghosts in the messages of a bag, and the worlds that sent these messages. A world that sent
// an empty one is among them.
ReceivedGhosts ghosts_in(Bag bag);

// Extrapolates ghosts for the step in progress, and notes in view() what the next step needs to do
// so. If it is off, the world ignores ghosts that it has not received, and view() stays empty.
class GhostExtrapolation {
 public:
  explicit GhostExtrapolation(StepInProgress& step) : step_(step) {}

  bool is_on() const { return step_.around.ghosts != GhostMode::kReceivedOnly && step_.divided(); }
  // Begins a step. `before`: the view() of the step before. `audits`: whether to count how many
  // extrapolated ghosts come true.
  void start(const ForeignView& before, bool audits);

  // Worlds that get ghosts in this step, if only an empty message; ascending.
  const std::vector<WorldId>& pending_notices() const { return pending_; }
  void note_migrants_from(std::span<const WorldId> sources);

  // All ghosts of step `step`: those of the bag, and extrapolated ones of whoever sends later.
  std::vector<Ghost> complete(std::int64_t step, Bag bag, const ForeignView& before);
  // The same for any step: `received` with extrapolated ghosts. Who has sent ghosts of the step
  // knows better than any extrapolation.
  ReceivedGhosts completed(const Rules& rules, const ForeignView& before, ReceivedGhosts received);
  // The same for a step that had been executed with the ghosts `was`, when `before` differed in the
  // ghosts `changed` only: an extrapolated ghost is a function of what was known of its body alone.
  ReceivedGhosts completed_again(const Rules& rules, const ForeignView& before,
                                 std::span<const physics::BodyId> changed,
                                 const ReceivedGhosts& was, ReceivedGhosts received);
  // Counts what has come of the ghosts of a step, and what is extrapolated in it.
  void audit(std::int64_t step, const ForeignView& before, const ReceivedGhosts& received);
  void audit_contacts(std::int64_t step, const std::map<WorldId, Fragment>& fragments);
  void commit(std::int64_t step) { audit_.commit(step, step_.work.worlds); }

  // What happens in this step: ghosts and bodies that go to another world, and how foreign bodies
  // of the gathered island end, which has been solved here. Of other foreign bodies this world does
  // not know all contacts.
  void note_ghosts_to(WorldId other);
  void note_migrant_to(WorldId owner, physics::BodyId id, const physics::BodyState& state);
  void note_solved(std::span<const std::uint32_t> bodies, const KnownBodies& known);
  // The gathered island is solved again.
  void forget_solved();

  // What this step leaves, as far as it goes. For the buffer entry, which may take it.
  ForeignView& view() { return view_; }

 private:
  StepInProgress& step_;
  bool audits_ = false;
  std::vector<WorldId> pending_;
  ForeignView view_;
  ExtrapolationAudit audit_;
};

}  // namespace soda::models
