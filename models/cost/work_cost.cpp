#include "models/cost/work_cost.hpp"

#include <algorithm>

namespace soda::models {
namespace {

// Nanoseconds, measured on one core.
constexpr std::int64_t kEvent = 300;
constexpr std::int64_t kBody = 200;  // box, integration, copies
constexpr std::int64_t kPair = 40;
constexpr std::int64_t kContactPoint = 300;  // rows built, impulses stored
constexpr std::int64_t kIsland = 500;
constexpr std::int64_t kRowIteration = 45;
constexpr std::int64_t kMultiplicationsPerNs = 1;  // of a factorisation
constexpr std::int64_t kJointRow = 4000;           // of all factorisations and aims of a step
constexpr std::int64_t kJointFactors = 5;          // factorisations of joint rows in a step
constexpr std::int64_t kImpactSearch = 2500;
constexpr std::int64_t kDrive = 50;
constexpr std::int64_t kBorderTest = 50;
constexpr std::int64_t kRecord = 250;  // a ghost, contact, record or migrant, encoded or decoded
constexpr std::int64_t kBytesPerNs = 2;
constexpr std::int64_t kStoredEntry = 300;  // its frame, read and written
constexpr std::int64_t kStoredBody = 50;    // read, compared, packed
constexpr std::int64_t kGvt = 1000;         // a report and an outcome, of all worlds of a processor
constexpr std::int64_t kCommit = 100;       // handing it on, and collecting what it left

constexpr std::int64_t kSampledBody = 500;  // what measuring a load costs (load_sample.hpp)

constexpr std::int64_t test_ns(physics::ShapeKernel kernel) {
  switch (kernel) {
    case physics::ShapeKernel::kAnalytic:
      return 150;
    case physics::ShapeKernel::kBoxBox:
      return 600;
    case physics::ShapeKernel::kHalfSpace:
      return 400;
    case physics::ShapeKernel::kPolytopeClip:
      return 1500;
    case physics::ShapeKernel::kCore:
    case physics::ShapeKernel::kMesh:
      return 4000;
    case physics::ShapeKernel::kCount:
      break;
  }
  return 0;
}

std::int64_t grown(std::uint64_t before, std::uint64_t after) {
  return static_cast<std::int64_t>(after - before);
}

std::int64_t solves_ns(const physics::StageCounters& before, const physics::StageCounters& after) {
  return kIsland * grown(before.islands_solved, after.islands_solved) +
         kRowIteration * (grown(before.row_sweeps, after.row_sweeps) +
                          grown(before.block_row_sweeps, after.block_row_sweeps)) +
         grown(before.factor_multiplications, after.factor_multiplications) / kMultiplicationsPerNs;
}

std::int64_t physics_ns(const physics::StageCounters& before, const physics::StageCounters& after) {
  std::int64_t cost = kBody * grown(before.boxes, after.boxes);
  cost += kPair * grown(before.candidate_pairs, after.candidate_pairs);
  for (std::size_t kernel = 0; kernel < before.narrowphase_tests.size(); ++kernel)
    cost += test_ns(static_cast<physics::ShapeKernel>(kernel)) *
            grown(before.narrowphase_tests[kernel], after.narrowphase_tests[kernel]);
  cost += kContactPoint * grown(before.contact_points, after.contact_points);
  cost += solves_ns(before, after);
  cost += kJointRow * grown(before.joint_rows, after.joint_rows);
  cost += kImpactSearch * grown(before.impact_searches(), after.impact_searches());
  return cost + kDrive * (grown(before.driven_bodies, after.driven_bodies) +
                          grown(before.forced_bodies, after.forced_bodies));
}

std::int64_t division_ns(const WorldCounters& before, const WorldCounters& after) {
  return kBorderTest * grown(before.border_tests, after.border_tests) +
         kRecord * (grown(before.ghosts_sent, after.ghosts_sent) +
                    grown(before.fragments_sent, after.fragments_sent) +
                    grown(before.records_sent, after.records_sent) +
                    grown(before.migrations, after.migrations)) +
         kSampledBody * grown(before.bodies_sampled, after.bodies_sampled);
}

std::int64_t checkpoints_ns(const WorldCounters& before, const WorldCounters& after) {
  return kStoredEntry * grown(before.entries_stored, after.entries_stored) +
         kStoredBody * grown(before.bodies_stored, after.bodies_stored) +
         (grown(before.state_bytes_stored, after.state_bytes_stored) +
          grown(before.memo_bytes_stored, after.memo_bytes_stored)) /
             kBytesPerNs;
}

}  // namespace

kernel::ExecutionCost work_cost(const WorkReading& before, const WorkReading& after,
                                kernel::Synchronisation synchronisation) {
  const std::int64_t replicated_ns = physics_ns(before.replicated, after.replicated);
  const std::int64_t alone_ns =
      kEvent * grown(before.worlds.events_alone, after.worlds.events_alone);
  const bool keeps_checkpoints = synchronisation == kernel::Synchronisation::kOptimistic;
  return {
      .useful_ns = alone_ns + physics_ns(before.stages, after.stages) - replicated_ns,
      .replicated_ns = replicated_ns,
      .division_ns = kEvent - alone_ns + division_ns(before.worlds, after.worlds),
      .checkpoints_ns = keeps_checkpoints ? checkpoints_ns(before.worlds, after.worlds) : 0,
      .sending_ns = grown(before.worlds.bytes_sent, after.worlds.bytes_sent) / kBytesPerNs,
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

std::int64_t undivided_cost_ns(std::uint64_t events, const physics::StageCounters& stages) {
  return kEvent * static_cast<std::int64_t>(events) + physics_ns({}, stages);
}

std::int64_t gvt_cost_ns() { return kGvt; }
std::int64_t commit_cost_ns() { return kCommit; }

std::int64_t body_cost_ns() { return kBody + kBorderTest; }
std::int64_t test_cost_ns(physics::ShapeKernel kernel) { return kPair + test_ns(kernel); }
std::int64_t point_cost_ns() { return kContactPoint; }
std::int64_t record_cost_ns() { return kRecord; }

// With friction, which is one row, as it is counted.
std::int64_t solve_cost_ns(std::uint32_t contact_points, std::uint64_t iterations,
                           std::uint64_t multiplications) {
  return kIsland + static_cast<std::int64_t>(multiplications) / kMultiplicationsPerNs +
         kRowIteration * static_cast<std::int64_t>(2 * contact_points * iterations);
}

std::int64_t joint_rows_cost_ns(std::uint64_t rows) {
  return kJointRow * static_cast<std::int64_t>(rows);
}

std::int64_t joint_factors_cost_ns(std::uint64_t multiplications) {
  return kJointFactors * static_cast<std::int64_t>(multiplications) / kMultiplicationsPerNs;
}

std::int64_t sweep_cost_ns(std::uint64_t contact_points) {
  return kRowIteration * static_cast<std::int64_t>(2 * contact_points);
}

}  // namespace soda::models
