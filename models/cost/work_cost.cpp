#include "models/cost/work_cost.hpp"

#include <algorithm>

namespace soda::models {
namespace {

constexpr CostWeights kUsual;
constexpr std::int64_t kPerNs = 1000;
constexpr std::int64_t kJointFactors = 5;  // factorisations of joint rows in a step

std::int64_t grown(std::uint64_t before, std::uint64_t after) {
  return static_cast<std::int64_t>(after - before);
}

std::int64_t times(std::uint64_t count, std::int64_t each_ps) {
  return static_cast<std::int64_t>(count) * each_ps;
}

std::int64_t solves_ps(const CostWeights& weights, const physics::StageCounters& before,
                       const physics::StageCounters& after) {
  return weights.island_ps * grown(before.islands_solved, after.islands_solved) +
         weights.row_iteration_ps * (grown(before.row_sweeps, after.row_sweeps) +
                                     grown(before.joint_sweeps, after.joint_sweeps) +
                                     grown(before.block_row_sweeps, after.block_row_sweeps)) +
         weights.multiplication_ps *
             grown(before.factor_multiplications, after.factor_multiplications);
}

std::int64_t physics_ps(const CostWeights& weights, const physics::StageCounters& before,
                        const physics::StageCounters& after) {
  std::int64_t cost = weights.body_ps * grown(before.boxes, after.boxes);
  cost += weights.pair_ps * grown(before.candidate_pairs, after.candidate_pairs);
  for (std::size_t kernel = 0; kernel < before.narrowphase_tests.size(); ++kernel)
    cost += weights.test_ps[kernel] *
            grown(before.narrowphase_tests[kernel], after.narrowphase_tests[kernel]);
  cost += weights.contact_point_ps * grown(before.contact_points, after.contact_points);
  cost += solves_ps(weights, before, after);
  cost += weights.joint_row_ps * grown(before.joint_rows, after.joint_rows);
  cost += weights.impact_search_ps * grown(before.impact_searches(), after.impact_searches());
  return cost + weights.drive_ps * (grown(before.driven_bodies, after.driven_bodies) +
                                    grown(before.forced_bodies, after.forced_bodies));
}

std::int64_t division_ps(const CostWeights& weights, const WorldCounters& before,
                         const WorldCounters& after) {
  return weights.border_test_ps * grown(before.border_tests, after.border_tests) +
         weights.record_ps * (grown(before.ghosts_sent, after.ghosts_sent) +
                              grown(before.fragments_sent, after.fragments_sent) +
                              grown(before.records_sent, after.records_sent) +
                              grown(before.migrations, after.migrations)) +
         weights.sampled_body_ps * grown(before.bodies_sampled, after.bodies_sampled);
}

std::int64_t checkpoints_ps(const CostWeights& weights, const WorldCounters& before,
                            const WorldCounters& after) {
  return weights.stored_entry_ps * grown(before.entries_stored, after.entries_stored) +
         weights.stored_body_ps * grown(before.bodies_stored, after.bodies_stored) +
         weights.byte_ps * (grown(before.state_bytes_stored, after.state_bytes_stored) +
                            grown(before.memo_bytes_stored, after.memo_bytes_stored));
}

}  // namespace

kernel::ExecutionCost work_cost(const WorkReading& before, const WorkReading& after,
                                kernel::Synchronisation synchronisation,
                                const CostWeights& weights) {
  const std::int64_t replicated_ps = physics_ps(weights, before.replicated, after.replicated);
  const std::int64_t alone_ps =
      weights.event_ps * grown(before.worlds.events_alone, after.worlds.events_alone);
  const std::int64_t physics_all_ps = physics_ps(weights, before.stages, after.stages);
  const bool keeps_checkpoints = synchronisation == kernel::Synchronisation::kOptimistic;
  return {
      .useful_ns = (alone_ps + physics_all_ps - replicated_ps) / kPerNs,
      .replicated_ns = replicated_ps / kPerNs,
      .division_ns =
          (weights.event_ps - alone_ps + division_ps(weights, before.worlds, after.worlds)) /
          kPerNs,
      .checkpoints_ns =
          keeps_checkpoints ? checkpoints_ps(weights, before.worlds, after.worlds) / kPerNs : 0,
      .sending_ns =
          weights.byte_ps * grown(before.worlds.bytes_sent, after.worlds.bytes_sent) / kPerNs,
  };
}

// The rest of a division is useful, so that nothing is lost by rounding.
kernel::ExecutionCost divided_as(const WorkReading& work, kernel::ExecutionCost standing) {
  const kernel::ExecutionCost cost = work_cost({}, work, kernel::Synchronisation::kOptimistic);
  const auto all = static_cast<double>(std::max<std::int64_t>(cost.sum_ns() - cost.sending_ns, 1));
  const auto part_ns = [&, whole = static_cast<double>(standing.useful_ns)](std::int64_t ns) {
    return static_cast<std::int64_t>(whole * static_cast<double>(ns) / all);
  };
  standing.replicated_ns = part_ns(cost.replicated_ns);
  standing.division_ns = part_ns(cost.division_ns);
  standing.checkpoints_ns = part_ns(cost.checkpoints_ns);
  standing.useful_ns -= standing.replicated_ns + standing.division_ns + standing.checkpoints_ns;
  return standing;
}

std::int64_t undivided_cost_ns(std::uint64_t events, const physics::StageCounters& stages,
                               const CostWeights& weights) {
  return (times(events, weights.event_ps) + physics_ps(weights, {}, stages)) / kPerNs;
}

std::int64_t body_cost_ns() { return (kUsual.body_ps + kUsual.border_test_ps) / kPerNs; }
std::int64_t test_cost_ns(physics::ShapeKernel kernel) {
  return (kUsual.pair_ps + kUsual.test_ps[static_cast<std::size_t>(kernel)]) / kPerNs;
}
std::int64_t point_cost_ns() { return kUsual.contact_point_ps / kPerNs; }
std::int64_t record_cost_ns() { return kUsual.record_ps / kPerNs; }

// With friction, which is one row, as it is counted.
std::int64_t solve_cost_ns(std::uint32_t contact_points, std::uint64_t iterations,
                           std::uint64_t multiplications) {
  return (kUsual.island_ps + times(multiplications, kUsual.multiplication_ps) +
          times(std::uint64_t{2} * contact_points * iterations, kUsual.row_iteration_ps)) /
         kPerNs;
}

std::int64_t joint_rows_cost_ns(std::uint64_t rows) {
  return times(rows, kUsual.joint_row_ps) / kPerNs;
}

std::int64_t joint_factors_cost_ns(std::uint64_t multiplications) {
  return kJointFactors * times(multiplications, kUsual.multiplication_ps) / kPerNs;
}

std::int64_t sweep_cost_ns(std::uint64_t contact_points) {
  return times(2 * contact_points, kUsual.row_iteration_ps) / kPerNs;
}

}  // namespace soda::models
