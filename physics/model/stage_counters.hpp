// Work done by each stage of a step. A stage that a scene does not need must stay at zero.
#pragma once

#include <array>
#include <cstdint>

namespace soda::physics {

// Narrowphase kernels, by the shapes they take.
enum class ShapeKernel : std::uint32_t {
  kAnalytic,  // sphere against sphere, box, capsule, cylinder, halfspace; capsule-capsule
  kBoxBox,
  kHalfSpace,     // vertices, rims or end spheres against a halfspace
  kPolytopeClip,  // boxes and hulls: reference face clipping
  kCore,          // GJK on a shrunk core: capsules, cylinders against polytopes
  kMesh,          // BVH traversal and triangle contacts
  kCount
};
const char* name_of(ShapeKernel kernel);

struct StageCounters {
  // Bodies of which the broadphase knew where their swept box lies: it was made, or is in a fat box
  // that was kept (pair_cache.hpp). Which of both depends on what came before, so it is not told.
  std::uint64_t boxes = 0;
  std::uint64_t candidate_pairs = 0;  // out of the broadphase
  std::array<std::uint64_t, static_cast<std::size_t>(ShapeKernel::kCount)> narrowphase_tests{};
  // Pairs that FCL was asked about, and those of which it said nothing of use: an own routine did.
  std::uint64_t fcl_calls = 0, fcl_failures = 0;
  std::uint64_t manifolds = 0;
  std::uint64_t contact_points = 0;
  std::uint64_t free_bodies_advanced = 0;  // bodies without contact
  std::uint64_t islands_solved = 0;
  // Not among them: islands that stay as they are (sleeping.hpp). Pairs whose contacts are known
  // from the step before, for both bodies are at rest (sleeping_islands.hpp).
  std::uint64_t islands_at_rest = 0, pairs_at_rest = 0;
  std::uint64_t islands_again = 0;           // of those solved, in a further pass (sent_on.hpp)
  std::uint64_t direct_islands = 0;          // of those solved, by Newton's method
  std::uint64_t solver_iterations = 0;       // and Newton steps, summed over islands
  std::uint64_t row_sweeps = 0;              // contact rows times those, of what is not in blocks
  std::uint64_t factor_multiplications = 0;  // of all factorisations, roughly
  std::uint64_t joint_sweeps = 0;            // joint rows times iterations (swept_joints.hpp)
  std::uint64_t normal_rows = 0;
  std::uint64_t friction_rows = 0;
  std::uint64_t conveyor_rows = 0;  // friction rows against a moving surface
  std::uint64_t rolling_rows = 0;   // of rolling and torsional friction
  std::uint64_t joint_rows = 0;
  std::uint64_t limit_rows = 0, motor_rows = 0;  // among them
  std::uint64_t joints_broken = 0;
  std::uint64_t restitution_rows = 0;
  std::uint64_t warm_started_rows = 0;
  // Pairs whose time of impact was looked for: in flight (event_driven_impacts.hpp), after hits
  // (contact_impacts.hpp), of what contacts send on (end_contacts.hpp), of bodies
  // that joints draw along (linked_step.hpp).
  std::uint64_t flight_searches = 0, hit_searches = 0, unseen_searches = 0, linked_searches = 0;
  std::uint64_t sent_searches = 0;  // pairs of which hits sent one on (sent_on.hpp)
  std::uint64_t impacts = 0;        // of them, that took place
  std::uint64_t refined_steps = 0;  // single steps beyond the first that refinement took
  // Pairs looked at again at the end of a solve, and solves with what came round
  // (end_contacts.hpp).
  std::uint64_t turned_searches = 0, turned_solves = 0;
  // Islands of which impacts, hits or refinement ended at their budget of work: the laws are the
  // same, but the rest of the step is one step, of first order.
  std::uint64_t islands_over_budget = 0;
  // What comes to something without a rebound within a step in substeps (blows.hpp): shared out to
  // rounding, and left to what iterations make of it.
  std::uint64_t blows = 0, blows_left = 0;
  std::uint64_t driven_bodies = 0;  // bodies that got a drive's acceleration
  std::uint64_t forced_bodies = 0;  // bodies that got forces or damping of their own
  std::uint64_t kinematic_bodies = 0;
  // Large islands: those among islands_solved that were solved in blocks, the blocks, and rows
  // times iterations. Rows and iterations are among the others; rows of a border that two solvers
  // share count twice.
  std::uint64_t islands_in_blocks = 0, blocks_solved = 0, block_row_sweeps = 0;

  std::uint64_t impact_searches() const {
    return flight_searches + hit_searches + unseen_searches + linked_searches;
  }
  std::uint64_t islands_advanced() const { return islands_solved + islands_at_rest; }
};

StageCounters& operator+=(StageCounters& a, const StageCounters& b);

}  // namespace soda::physics
