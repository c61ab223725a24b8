#include "physics/model/stage_counters.hpp"

namespace soda::physics {

const char* name_of(ShapeKernel kernel) {
  switch (kernel) {
    case ShapeKernel::kAnalytic:
      return "analytic";
    case ShapeKernel::kBoxBox:
      return "box-box";
    case ShapeKernel::kHalfSpace:
      return "halfspace";
    case ShapeKernel::kPolytopeClip:
      return "polytope-clip";
    case ShapeKernel::kCore:
      return "core";
    case ShapeKernel::kMesh:
      return "mesh";
    case ShapeKernel::kCount:
      break;
  }
  return "";
}

StageCounters& operator+=(StageCounters& a, const StageCounters& b) {
  a.boxes += b.boxes;
  a.candidate_pairs += b.candidate_pairs;
  for (std::size_t i = 0; i < a.narrowphase_tests.size(); ++i) {
    a.narrowphase_tests[i] += b.narrowphase_tests[i];
  }
  a.fcl_calls += b.fcl_calls;
  a.fcl_failures += b.fcl_failures;
  a.manifolds += b.manifolds;
  a.contact_points += b.contact_points;
  a.free_bodies_advanced += b.free_bodies_advanced;
  a.islands_solved += b.islands_solved;
  a.islands_at_rest += b.islands_at_rest;
  a.pairs_at_rest += b.pairs_at_rest;
  a.islands_again += b.islands_again;
  a.direct_islands += b.direct_islands;
  a.solver_iterations += b.solver_iterations;
  a.row_sweeps += b.row_sweeps;
  a.factor_multiplications += b.factor_multiplications;
  a.joint_sweeps += b.joint_sweeps;
  a.normal_rows += b.normal_rows;
  a.friction_rows += b.friction_rows;
  a.conveyor_rows += b.conveyor_rows;
  a.rolling_rows += b.rolling_rows;
  a.joint_rows += b.joint_rows;
  a.limit_rows += b.limit_rows;
  a.motor_rows += b.motor_rows;
  a.joints_broken += b.joints_broken;
  a.restitution_rows += b.restitution_rows;
  a.warm_started_rows += b.warm_started_rows;
  a.flight_searches += b.flight_searches;
  a.hit_searches += b.hit_searches;
  a.unseen_searches += b.unseen_searches;
  a.linked_searches += b.linked_searches;
  a.sent_searches += b.sent_searches;
  a.impacts += b.impacts;
  a.turned_searches += b.turned_searches;
  a.turned_solves += b.turned_solves;
  a.refined_steps += b.refined_steps;
  a.islands_over_budget += b.islands_over_budget;
  a.blows += b.blows;
  a.blows_left += b.blows_left;
  a.driven_bodies += b.driven_bodies;
  a.forced_bodies += b.forced_bodies;
  a.kinematic_bodies += b.kinematic_bodies;
  a.islands_in_blocks += b.islands_in_blocks;
  a.blocks_solved += b.blocks_solved;
  a.block_row_sweeps += b.block_row_sweeps;
  return a;
}

}  // namespace soda::physics
