#include "physics/solvers/split_solver.hpp"

#include <algorithm>
#include <iterator>

#include "physics/constraints/displacement_bounds.hpp"
#include "physics/math/solver_body.hpp"
#include "physics/solvers/contact_solver.hpp"
#include "physics/solvers/island_motion.hpp"

namespace soda::physics {
void add(const BlockReport& block, IslandReport& island) {
  island.max_penetration_m = std::max(island.max_penetration_m, block.max_penetration_m);
  island.constraint_residual_m_s =
      std::max(island.constraint_residual_m_s, block.constraint_residual_m_s);
  island.static_impulse_newton_s += block.static_impulse_newton_s;
  island.static_angular_impulse_newton_m_s += block.static_angular_impulse_newton_m_s;
}

BlockSolver::BlockSolver(const LargeIsland& island, std::uint32_t first, std::uint32_t last,
                         StageCounters& counters)
    : island_(island),
      first_(first),
      last_(last),
      first_border_(first > 0 ? first - 1 : 0),
      stages_(stages({island.scene, island.dt_s, island.ids, island.states})),
      fastest_correction_(fastest_correction(island.scene, island.ids)) {
  StageCounters built;
  for (std::uint32_t i = first_; i < last_; ++i) {
    blocks_.push_back(part_of(island_.blocks.inside[i], built));
    Part& part = blocks_.back();
    build_rows(step_of(part), part.manifolds, part.problem, built);
  }
  const auto borders = static_cast<std::uint32_t>(island_.blocks.borders.size());
  for (std::uint32_t i = first_border_; i < std::min(last_, borders); ++i) add_border(i, built);
  const double dt_s = island_.dt_s;
  const std::uint32_t count = stages_ / 2;
  for (Part& part : blocks_) begin_substeps(dt_s, count, part.states, part.problem, part.substeps);
  for (Border& border : borders_)
    begin_substeps(dt_s, count, {}, border.part.problem, border.part.substeps);
  built.blocks_solved = last_ - first_;
  counters += built;
}

BlockSolver::Part BlockSolver::part_of(const IslandPart& places, StageCounters& counters) const {
  Part part;
  for (const std::uint32_t body : places.bodies) part.ids.push_back(island_.ids[body]);
  part.manifolds = {island_.manifolds, places.manifolds};
  part.states = {island_.states, places.bodies};
  load_bodies(step_of(part), part.problem.bodies, counters);
  part.free.assign(part.problem.bodies.begin(), part.problem.bodies.end() - 1);
  return part;
}

// Impulses of the step before act on the border's bodies in the blocks of this solver, too. The
// other bodies' velocities come with the first exchange.
void BlockSolver::add_border(std::uint32_t index, StageCounters& counters) {
  const IslandPart& places = island_.blocks.borders[index];
  StageCounters counted_with_the_block;
  Border border{part_of(places, counted_with_the_block), {}, {}};
  for (std::uint32_t i = 0; i < places.bodies.size(); ++i) {
    const std::uint32_t body = places.bodies[i];
    Side& side = island_.blocks.block_of[body] == index ? border.lower : border.upper;
    side.in_border.push_back(i);
    side.in_block.push_back(island_.blocks.place_in[body]);
  }
  Part& part = border.part;
  load(index, border);
  build_rows(step_of(part), part.manifolds, part.problem, counters);
  store(index, border);
  borders_.push_back(std::move(border));
}

void BlockSolver::copy(const Part& from, std::span<const std::uint32_t> from_places, Part& to,
                       std::span<const std::uint32_t> to_places) {
  for (std::size_t i = 0; i < from_places.size(); ++i) {
    const SolverBody& source = from.problem.bodies[from_places[i]];
    SolverBody& target = to.problem.bodies[to_places[i]];
    target.linear = source.linear;
    target.angular = source.angular;
    if (!to.substeps.displacements.empty())
      to.substeps.displacements[to_places[i]] = from.substeps.displacements[from_places[i]];
  }
}

void BlockSolver::load(std::uint32_t index, Border& border) {
  if (solves(index)) copy(block(index), border.lower.in_block, border.part, border.lower.in_border);
  if (solves(index + 1))
    copy(block(index + 1), border.upper.in_block, border.part, border.upper.in_border);
}

void BlockSolver::store(std::uint32_t index, const Border& border) {
  if (solves(index)) copy(border.part, border.lower.in_border, block(index), border.lower.in_block);
  if (solves(index + 1))
    copy(border.part, border.upper.in_border, block(index + 1), border.upper.in_block);
}

std::uint32_t BlockSolver::stages(const SolveStep& step) { return 2 * substeps_under_load(step); }

void BlockSolver::iterate(std::uint32_t stage, Part& part, StageCounters& counters) {
  if (stage % 2 == 0) {
    press(part.problem, part.substeps);
  } else {
    relax(part.problem, part.substeps);
  }
  counters.block_row_sweeps += rows_of(part.problem);
}

void BlockSolver::solve_blocks(std::uint32_t stage, StageCounters& counters) {
  for (Part& part : blocks_) {
    if (stage % 2 != 0) {
      move_on(part.problem, part.substeps);
    } else if (stage > 0) {
      go_on(part.problem, part.substeps);
    }
    iterate(stage, part, counters);
  }
}

void BlockSolver::solve_borders(std::uint32_t stage, StageCounters& counters) {
  for (std::uint32_t i = 0; i < borders_.size(); ++i) {
    load(first_border_ + i, borders_[i]);
    iterate(stage, borders_[i].part, counters);
    store(first_border_ + i, borders_[i]);
  }
  if (stage + 1 < stages_) return;
  for (Part& part : blocks_) end_substeps(part.problem, part.substeps);
  for (Border& border : borders_) end_substeps(border.part.problem, border.part.substeps);
}

const BlockSolver::Border* BlockSolver::border_at(std::uint32_t index) const {
  return index >= first_border_ && index - first_border_ < borders_.size()
             ? &borders_[index - first_border_]
             : nullptr;
}

std::vector<BorderBody> BlockSolver::told(const Part& part, std::span<const std::uint32_t> places) {
  std::vector<BorderBody> bodies;
  for (const std::uint32_t place : places) {
    const SolverBody& body = part.problem.bodies[place];
    bodies.push_back({body.linear, body.angular, part.substeps.displacements[place]});
  }
  return bodies;
}

std::vector<BorderBody> BlockSolver::at_lower() const {
  if (first_ == 0) return {};
  return told(block(first_), border_at(first_ - 1)->upper.in_block);
}

std::vector<BorderBody> BlockSolver::at_upper() const {
  if (last_ == island_.blocks.count()) return {};
  return told(block(last_ - 1), border_at(last_ - 1)->lower.in_block);
}

bool BlockSolver::take(std::span<const BorderBody> bodies, const Side& side, Part& part) {
  if (bodies.size() != side.in_border.size()) return false;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    SolverBody& body = part.problem.bodies[side.in_border[i]];
    body.linear = bodies[i].linear;
    body.angular = bodies[i].angular;
    part.substeps.displacements[side.in_border[i]] = bodies[i].displacement;
  }
  return true;
}

bool BlockSolver::take_lower(std::span<const BorderBody> bodies) {
  if (first_ == 0) return bodies.empty();
  Border& border = borders_.front();
  return take(bodies, border.lower, border.part);
}

bool BlockSolver::take_upper(std::span<const BorderBody> bodies) {
  if (last_ == island_.blocks.count()) return bodies.empty();
  Border& border = borders_.back();
  return take(bodies, border.upper, border.part);
}

std::uint32_t BlockSolver::rebound(StageCounters& counters) {
  bool any = false;
  const auto aim = [&any](Part& part) {
    part.plastic = solved_contacts(part.problem);
    any = set_restitution_targets(part.problem) || any;
    // Bodies have moved: the rebound changes how they leave the step only.
    for (RowContact& contact : part.problem.contacts) contact.bounces = false;
  };
  for (Part& part : blocks_) aim(part);
  for (Border& border : borders_) aim(border.part);
  if (!any) return 0;
  const auto iterate_rebounds = [&counters](bool forward, ContactProblem& problem) {
    iterate_velocities(forward, problem);
    counters.block_row_sweeps += rows_of(problem);
  };
  const std::uint32_t iterations = stages_;
  for (std::uint32_t i = 0; i < iterations; ++i) {
    for (Part& part : blocks_) iterate_rebounds(i % 2 == 0, part.problem);
    for (std::uint32_t k = 0; k < borders_.size(); ++k) {
      load(first_border_ + k, borders_[k]);
      iterate_rebounds(i % 2 == 0, borders_[k].part.problem);
      store(first_border_ + k, borders_[k]);
    }
  }
  return iterations;
}

void BlockSolver::take_share(double share) {
  const auto take = [share](Part& part) {
    physics::take_share(share, part.free, nullptr, part.problem);
  };
  for (Part& part : blocks_) take(part);
  for (Border& border : borders_) take(border.part);
}

void BlockSolver::take_rebounds(double share) {
  const auto take = [share](Part& part) {
    const std::span<const SolverBody> bodies =
        std::span(part.plastic.bodies).first(part.free.size());
    physics::take_share(share, bodies, &part.plastic, part.problem);
  };
  for (Part& part : blocks_) take(part);
  for (Border& border : borders_) take(border.part);
}

namespace {

void add_flights(const Flights& of_border, std::span<const std::uint32_t> in_border,
                 std::span<const std::uint32_t> in_block, Flights& flights) {
  for (std::size_t i = 0; i < in_border.size(); ++i) {
    flights[in_block[i]].supported |= of_border[in_border[i]].supported;
    flights[in_block[i]].not_yet_m += of_border[in_border[i]].not_yet_m;
  }
}

}  // namespace

Flights BlockSolver::flights_of(std::uint32_t index) const {
  Flights flights = find_flights(block(index).problem);
  const auto add_border = [&flights](const Border& border, const Side& side) {
    add_flights(find_flights(border.part.problem), side.in_border, side.in_block, flights);
  };
  if (index > 0) add_border(*border_at(index - 1), border_at(index - 1)->upper);
  if (const Border* const behind = border_at(index)) add_border(*behind, behind->lower);
  return flights;
}

BlockReport BlockSolver::report(std::uint32_t index) const {
  IslandReport sum;
  StepWork work;
  const Part& part = block(index);
  const Flights flights = flights_of(index);
  add_contacts(part.free, part.problem, work);
  add_driven(part.free, part.problem, work);
  add_fields(step_of(part), part.free, flights, flights, part.problem, work);
  report_contacts(part.states, part.problem, sum);
  sum.constraint_residual_m_s = residual_m_s(part.problem);
  if (const Border* const border = border_at(index)) {
    add_contacts(border->part.free, border->part.problem, work);
    report_contacts(border->part.states, border->part.problem, sum);
    sum.constraint_residual_m_s =
        std::max(sum.constraint_residual_m_s, residual_m_s(border->part.problem));
  }
  return {sum.max_penetration_m, sum.constraint_residual_m_s, sum.static_impulse_newton_s,
          sum.static_angular_impulse_newton_m_s, work};
}

namespace {

// A contact impulse and the body that keeps it, as a place in its block.
struct KeptImpulse {
  std::uint32_t body = 0;
  ContactImpulse impulse;
};

bool kept_before(const KeptImpulse& x, const KeptImpulse& y) {
  if (x.body != y.body) return x.body < y.body;
  if (x.impulse.other != y.impulse.other) return x.impulse.other < y.impulse.other;
  return x.impulse.part != y.impulse.part ? x.impulse.part < y.impulse.part
                                          : x.impulse.feature < y.impulse.feature;
}

constexpr std::uint32_t kElsewhere = 0xffffffffu;

// Rows whose body a is at[a] in the block.
template <class At>
void keep_impulses(const IndexedSpan<ContactManifold>& manifolds, const ContactProblem& problem,
                   const At& at, std::vector<KeptImpulse>& kept) {
  for (std::size_t row = 0; row < problem.normals.size(); ++row) {
    const std::uint32_t body = at(problem.normals[row].a);
    if (body == kElsewhere || problem.normals[row].impulse_newton_s == 0.0) continue;
    kept.push_back({body, stored_impulse(manifolds, problem, row)});
  }
}

}  // namespace

void BlockSolver::move(std::uint32_t index, std::vector<BodyState>& moved,
                       std::vector<AdvanceFault>& faults) const {
  const Part& part = block(index);
  const Flights flights = flights_of(index);
  std::vector<KeptImpulse> kept;
  keep_impulses(
      part.manifolds, part.problem, [](std::uint32_t a) { return a; }, kept);
  const auto of_borders = static_cast<std::ptrdiff_t>(kept.size());
  const auto add_border = [&](const Border& border, const Side& side) {
    std::vector<std::uint32_t> in_block(border.part.ids.size(), kElsewhere);
    for (std::size_t i = 0; i < side.in_border.size(); ++i)
      in_block[side.in_border[i]] = side.in_block[i];
    keep_impulses(
        border.part.manifolds, border.part.problem,
        [&in_block](std::uint32_t a) { return in_block[a]; }, kept);
  };
  if (index > 0) add_border(*border_at(index - 1), border_at(index - 1)->upper);
  if (const Border* const behind = border_at(index)) add_border(*behind, behind->lower);
  std::sort(kept.begin() + of_borders, kept.end(), kept_before);
  std::inplace_merge(kept.begin(), kept.begin() + of_borders, kept.end(), kept_before);

  auto next = kept.begin();
  for (std::uint32_t i = 0; i < part.ids.size(); ++i) {
    moved.push_back(part.states[i]);
    const SolverBody& body = part.problem.bodies[i];
    const PositionCorrection beyond =
        beyond_final_velocity(island_.dt_s, fastest_correction_, part.states[i], body, flights[i],
                              part.substeps.displacements[i]);
    const bool accepted =
        move_body({island_.scene, island_.dt_s, part.ids[i], body, flights[i], &beyond},
                  moved.back(), faults);
    if (accepted) moved.back().impulses.clear();
    for (; next != kept.end() && next->body == i; ++next)
      if (accepted) moved.back().impulses.push_back(next->impulse);
  }
}

}  // namespace soda::physics
