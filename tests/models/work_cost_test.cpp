// Work cost: what an event costs is what its parts cost.
#include "models/cost/work_cost.hpp"

#include <gtest/gtest.h>

namespace soda::models {
namespace {

std::int64_t cost(const physics::StageCounters& before, const physics::StageCounters& after) {
  return work_cost({before, {}, {}}, {after, {}, {}}, kernel::Synchronisation::kOptimistic)
      .sum_ns();
}

// Rows and sweeps of the solve of one island.
physics::StageCounters solve(std::uint64_t rows, std::uint64_t sweeps) {
  physics::StageCounters counters;
  counters.islands_solved = 1;
  counters.normal_rows = rows;
  counters.solver_iterations = sweeps;
  counters.row_sweeps = rows * sweeps;
  return counters;
}

// A step with eighty impacts is eighty short solves of few rows: no more than eighty times one.
TEST(WorkCost, ManySmallSolvesInOneEventCostNoMoreThanInEventsOfTheirOwn) {
  const physics::StageCounters one = solve(4, 30);
  const std::int64_t event = cost({}, {});
  physics::StageCounters all;
  std::int64_t apart = 0;
  for (int i = 0; i < 80; ++i) {
    physics::StageCounters next = all;
    next += one;
    apart += cost(all, next) - event;
    all = next;
  }
  EXPECT_EQ(cost({}, all) - event, apart);
  EXPECT_EQ(apart, 80 * (cost({}, one) - event));
}

TEST(WorkCost, AnEventWithoutWorkStillCostsSomething) { EXPECT_GT(cost({}, {}), 0); }

}  // namespace
}  // namespace soda::models
