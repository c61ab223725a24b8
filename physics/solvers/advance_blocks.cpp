// All blocks of a large island by one solver (split_solver.hpp).
#include <vector>

#include "physics/solvers/split_solver.hpp"

namespace soda::physics {

StepWork work_of(std::span<const BlockReport> blocks) {
  StepWork work;
  for (const BlockReport& block : blocks) work.add(block.work);
  return work;
}

namespace {

std::vector<BlockReport> reports_of(const BlockSolver& solver, std::uint32_t blocks) {
  std::vector<BlockReport> reports;
  for (std::uint32_t i = 0; i < blocks; ++i) reports.push_back(solver.report(i));
  return reports;
}

// What is unsolved of large overlaps, or of rebounds, puts in no energy.
std::vector<BlockReport> limit_blocks(std::uint32_t blocks, BlockSolver& solver) {
  std::vector<BlockReport> reports = reports_of(solver, blocks);
  const double share = allowed_share(work_of(reports));
  if (share == 1.0) return reports;
  solver.take_share(share);
  return reports_of(solver, blocks);
}

std::vector<BlockReport> clamp_rebounds(std::uint32_t blocks, std::span<const BlockReport> plastic,
                                        BlockSolver& solver) {
  std::vector<BlockReport> reports = reports_of(solver, blocks);
  if (!gives_energy(work_of(reports))) return reports;
  const auto with = [&](double share) {
    BlockSolver trial = solver;
    trial.take_rebounds(share);
    return work_of(reports_of(trial, blocks));
  };
  double share = share_without_gain(gain_of(work_of(plastic)).sum, gain_of(with(0.5)).sum,
                                    gain_of(work_of(reports)).sum);
  // Who is held may differ between the three.
  if (gives_energy(with(share))) share = 0.0;
  solver.take_rebounds(share);
  return reports_of(solver, blocks);
}

}  // namespace

void advance_blocks(const LargeIsland& island, std::span<BodyState> states, IslandReport& report,
                    StageCounters& counters, std::vector<AdvanceFault>& faults) {
  const auto blocks = static_cast<std::uint32_t>(island.blocks.count());
  StageCounters counted;
  BlockSolver solver(island, 0, blocks, counted);
  report.iterations = BlockSolver::stages({island.scene, island.dt_s, island.ids, island.states});
  for (std::uint32_t stage = 0; stage < report.iterations; ++stage) {
    solver.solve_blocks(stage, counted);
    solver.solve_borders(stage, counted);
  }
  std::vector<BlockReport> reports = limit_blocks(blocks, solver);
  if (counted.restitution_rows > 0) {
    report.iterations += solver.rebound(counted);
    reports = clamp_rebounds(blocks, reports, solver);
  }
  std::vector<std::vector<BodyState>> moved(blocks);
  for (std::uint32_t i = 0; i < blocks; ++i) {
    add(reports[i], report);
    solver.move(i, moved[i], faults);
  }
  for (std::uint32_t i = 0; i < blocks; ++i)
    for (std::size_t body = 0; body < moved[i].size(); ++body)
      states[island.blocks.inside[i].bodies[body]] = std::move(moved[i][body]);
  ++counted.islands_in_blocks;
  counted.solver_iterations += report.iterations;
  counters += counted;
}

}  // namespace soda::physics
