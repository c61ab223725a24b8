// Solving a large island block by block: what one solver of some of its blocks does, and what it
// has to hear from the solvers of the blocks beside them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/constraints/contact_rows.hpp"
#include "physics/math/indexed_span.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/island_report.hpp"
#include "physics/model/stage_counters.hpp"
#include "physics/solvers/energy_clamp.hpp"
#include "physics/solvers/island_blocks.hpp"
#include "physics/solvers/substeps.hpp"

namespace soda::physics {

// A large island at the start of a step, or of the rest of one that impacts have left. Refers to
// what it is made of.
struct LargeIsland {
  const SceneDescription& scene;
  double dt_s;
  std::span<const BodyId> ids;
  std::span<const ContactManifold> manifolds;
  std::span<const BodyState> states;
  const IslandBlocks& blocks;
};

// Present velocities of a body at a border, and its displacement since the step's start.
struct BorderBody {
  Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
  Displacement displacement;
};

// What a block, and the border between it and the next one, add to the island's report.
struct BlockReport {
  double max_penetration_m = 0.0;
  double constraint_residual_m_s = 0.0;
  Vec3 static_impulse_newton_s = Vec3::Zero();
  Vec3 static_angular_impulse_newton_m_s = Vec3::Zero();
  StepWork work;
};
void add(const BlockReport& block, IslandReport& island);
// Of all blocks of an island, in their order.
StepWork work_of(std::span<const BlockReport> blocks);

// Solves blocks [first, last) of an island and the borders at them, in substeps (substeps.hpp): in
// each iteration the rows inside the blocks, then those of the borders. Blocks have no body in
// common and neither have borders, so what comes out does not depend on which range is solved by
// whom: two solvers of neighbouring ranges both solve the border between them, alike.
//
// For each stage, which is an iteration: solve_blocks(); tell the solvers beside it what at_lower()
// and at_upper() say, take what they say; solve_borders(). Then the share of the impulses that the
// work of all blocks allows (energy_clamp.hpp: allowed_share), report() and move().
class BlockSolver {
 public:
  BlockSolver(const LargeIsland& island, std::uint32_t first, std::uint32_t last,
              StageCounters& counters);

  // Of the whole island.
  static std::uint32_t stages(const SolveStep& step);
  // stage 0, 1, ...
  void solve_blocks(std::uint32_t stage, StageCounters& counters);
  void solve_borders(std::uint32_t stage, StageCounters& counters);

  // The range's bodies at the border before it, at the one behind it; ascending by id. Empty where
  // the island ends.
  std::vector<BorderBody> at_lower() const;
  std::vector<BorderBody> at_upper() const;
  // What the solver before it has as at_upper(), and the one behind it as at_lower(). False, and
  // nothing taken, if their number is not that of this island.
  bool take_lower(std::span<const BorderBody> bodies);
  bool take_upper(std::span<const BorderBody> bodies);

  // After all stages: takes that share of all impulses, which all solvers of the island do alike.
  void take_share(double share);

  // For a solver of all blocks, then: brings about the rebounds of the rows that bounce, by as many
  // iterations. Returns their number.
  std::uint32_t rebound(StageCounters& counters);
  // Takes that share of what rebounds have changed.
  void take_rebounds(double share);

  BlockReport report(std::uint32_t block) const;
  // Appends the block's bodies after the step, in the order of its bodies.
  void move(std::uint32_t block, std::vector<BodyState>& moved,
            std::vector<AdvanceFault>& faults) const;

 private:
  // The rows of a block or of a border.
  struct Part {
    std::vector<BodyId> ids;
    IndexedSpan<ContactManifold> manifolds;
    IndexedSpan<BodyState> states;
    std::vector<SolverBody> free;  // velocities without contacts
    ContactProblem problem;
    SolvedContacts plastic;  // before rebounds
    Substeps substeps;
  };
  // Places in the border and in the block, of the border's bodies that are in one of its blocks.
  struct Side {
    std::vector<std::uint32_t> in_border, in_block;
  };
  struct Border {
    Part part;
    Side lower, upper;  // in the block before it, in the one behind it
  };

  SolveStep step_of(const Part& part) const {
    return {island_.scene, island_.dt_s, part.ids, part.states};
  }
  Part part_of(const IslandPart& places, StageCounters& counters) const;
  // Of the block's bodies, by all rows that act on them.
  Flights flights_of(std::uint32_t block) const;
  void add_border(std::uint32_t index, StageCounters& counters);
  static void iterate(std::uint32_t stage, Part& part, StageCounters& counters);
  // What bodies are doing that two parts have in common.
  static void copy(const Part& from, std::span<const std::uint32_t> from_places, Part& to,
                   std::span<const std::uint32_t> to_places);
  void load(std::uint32_t index, Border& border);         // from the range's blocks
  void store(std::uint32_t index, const Border& border);  // to them
  static std::vector<BorderBody> told(const Part& part, std::span<const std::uint32_t> places);
  static bool take(std::span<const BorderBody> bodies, const Side& side, Part& part);

  Part& block(std::uint32_t index) { return blocks_[index - first_]; }
  const Part& block(std::uint32_t index) const { return blocks_[index - first_]; }
  bool solves(std::uint32_t index) const { return index >= first_ && index < last_; }
  const Border* border_at(std::uint32_t index) const;  // null where the island ends

  const LargeIsland island_;
  const std::uint32_t first_, last_;
  const std::uint32_t first_border_;
  const std::uint32_t stages_;
  const FastestCorrection fastest_correction_;
  std::vector<Part> blocks_;
  std::vector<Border> borders_;
};

// All of it by one solver. `states` are those of the island; adds to `report`, which has what is
// known before the solve.
void advance_blocks(const LargeIsland& island, std::span<BodyState> states, IslandReport& report,
                    StageCounters& counters, std::vector<AdvanceFault>& faults);

}  // namespace soda::physics
