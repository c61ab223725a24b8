#include "physics/refinement.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "physics/contact_solver.hpp"
#include "physics/forces.hpp"
#include "physics/geometry_impl.hpp"
#include "physics/refined_trials.hpp"

namespace soda::physics {
namespace {

constexpr double kOwnTolerance = 1e-7;  // of a single body; of its width, for each part of a step

struct Limits {
  int most_solves = 0;
  int deepest = 0;  // halvings
};

// A change is closed in upon until its error, which halves with the part that holds it, is an
// eighth of any tolerance. Large islands take less solves, for each of theirs takes longer.
Limits limits_of(const SceneDescription& scene, std::size_t pairs) {
  constexpr std::size_t kMostSolves = 2000, kLeastSolves = 64, kPairsSolved = 128'000;
  if (!(scene.tolerance > 0.0)) return {150, 12};
  const std::size_t solves =
      std::clamp(kPairsSolved / std::max<std::size_t>(pairs, 1), kLeastSolves, kMostSolves);
  return {static_cast<int>(solves), 26};
}

// What errors a step may still have.
class ErrorBudget {
 public:
  explicit ErrorBudget(const SceneDescription& scene)
      : tolerance_(scene.tolerance), dt_s_(scene.dt_s), for_changes_(0.5 * tolerance_) {}

  // Half of what may still be spent on a change is kept for those that follow.
  bool allows(double widths, double time_s) const {
    if (!(tolerance_ > 0.0)) return widths <= kOwnTolerance;
    return widths <= share_of(time_s) + kForOne * for_changes_;
  }
  void spend(const StepError& error, double time_s, std::span<const BodyId> ids) {
    if (!(tolerance_ > 0.0)) return;
    for_changes_ -= std::clamp(error.widths - share_of(time_s), 0.0, for_changes_);
    sum_ += error.widths;
    if (!(error.widths > largest_)) return;
    largest_ = error.widths;
    worst_ = ids[error.body];
  }
  void tell(IslandReport& report) const {
    report.error_estimate = sum_;
    report.worst_body = worst_;
    report.beyond_tolerance = tolerance_ > 0.0 && !(sum_ <= tolerance_);
  }

 private:
  static constexpr double kForOne = 0.25;
  double share_of(double time_s) const { return 0.5 * tolerance_ * (time_s / dt_s_); }

  double tolerance_, dt_s_, for_changes_;
  double sum_ = 0.0, largest_ = 0.0;
  BodyId worst_{};
};

struct Part {
  double time_s = 0.0;
  int depth = 0;
};

struct PartResult {
  Trial trial;
  StepError error;
};

// What trials lead to: their limit, or the finest where that is nearer.
PartResult best_of(const RefinedIsland& island, std::span<const BodyState> from,
                   const Extrapolation& trials, Trial finest) {
  const StepError of_finest = trials.change(island.sizes);
  StepError of_limit = trials.error(island.sizes);
  if (of_finest.widths < 0.5 * of_limit.widths) return {std::move(finest), of_finest};
  Trial limit = trials.limit(finest);
  const double taken = take_back_gain(island, from, limit);
  if (taken > 1.0) return {std::move(finest), of_finest};
  if (taken > 0.0) of_limit.widths += taken * speed_of(island.sizes, limit.states).widths;
  return {std::move(limit), of_limit};
}

// One, two, four steps over the part, and more as long as each order brings the limit much nearer.
// Nothing if that is not within the budget, and the part can be halved.
std::optional<PartResult> refine_part(RefinedIsland& island, const ErrorBudget& budget,
                                      double time_s, bool can_be_halved,
                                      std::span<const BodyState> from,
                                      std::span<const ContactManifold> start, Trial one) {
  constexpr int kMostSteps = 16;
  constexpr double kMuchNearer = 0.125;
  const StepError change = change_of(island.sizes, from, one.states);
  if (budget.allows(change.widths, time_s)) return PartResult{std::move(one), change};
  const Trial two = try_steps(island, from, start, time_s, 2);
  Trial finest = try_steps(island, from, start, time_s, 4);
  if (two.failed || finest.failed) return PartResult{std::move(one), change};
  const StepError rough = roughness(island.sizes, from, one.path, two.path, finest.path, time_s);
  Extrapolation trials(one);
  trials.add(two);
  double before = trials.error(island.sizes).widths;
  trials.add(finest);
  for (int steps = 8;; steps *= 2) {
    const double now = trials.error(island.sizes).widths;
    PartResult best = best_of(island, from, trials, finest);
    best.error = larger(best.error, rough);
    if (budget.allows(best.error.widths, time_s)) return best;
    const bool nearer = now <= kMuchNearer * before && budget.allows(rough.widths, time_s);
    if (!nearer || steps > kMostSteps) {
      if (can_be_halved) return std::nullopt;
      const StepError of_finest = larger(trials.change(island.sizes), rough);
      return now <= kMuchNearer * before ? best : PartResult{std::move(finest), of_finest};
    }
    before = now;
    Trial next = try_steps(island, from, start, time_s, steps);
    if (next.failed) return best;
    finest = std::move(next);
    trials.add(finest);
  }
}

// The part, or nothing if it is to be halved.
std::optional<PartResult> advance_part(RefinedIsland& island, const Limits& limits,
                                       const ErrorBudget& budget, const Part& part,
                                       std::span<const BodyState> from,
                                       std::span<const ContactManifold> known) {
  std::vector<ContactManifold> found;
  if (known.empty()) found = contacts_at(island, part.time_s, from);
  const std::span<const ContactManifold> start = known.empty() ? found : known;
  Trial one = try_steps(island, from, start, part.time_s, 1);
  if (one.failed) return PartResult{std::move(one), {}};
  const bool can_be_halved = part.depth < limits.deepest && island.solves < limits.most_solves;
  return refine_part(island, budget, part.time_s, can_be_halved, from, start, std::move(one));
}

}  // namespace

std::vector<ContactManifold> found_again(const SceneDescription& scene, const Geometry& geometry,
                                         double dt_s, std::span<const BodyId> ids,
                                         std::span<const ContactManifold> manifolds,
                                         std::span<const BodyState> states,
                                         StageCounters& counters) {
  return contacts_at({scene, geometry, ids, manifolds, {}, counters}, dt_s, states);
}

bool is_refined(const SceneDescription& scene, const Geometry& geometry,
                std::span<const BodyId> ids, std::span<const ContactManifold> manifolds) {
  if (!(scene.tolerance > 0.0)) {
    const BodyParams& first = scene.bodies[index_of(ids[0])];
    if (ids.size() > 1 || is_pushed(first) || first.joints > 0) return false;
  }
  for (const ContactManifold& m : manifolds) {
    const std::uint32_t shape = scene.bodies[index_of(m.a)].shape;
    const double most_m = kSlop * geometry.impl().shapes[shape].shape.min_extent_m;
    for (std::uint32_t i = 0; i < m.count; ++i)
      if (m.points[i].separation_m < -most_m) return false;
  }
  return true;
}

IslandReport advance_refined(const SceneDescription& scene, const Geometry& geometry, double dt_s,
                             std::span<const BodyId> ids,
                             std::span<const ContactManifold> manifolds,
                             std::span<BodyState> states, StageCounters& counters,
                             std::vector<AdvanceFault>& faults) {
  RefinedIsland island{scene, geometry, ids, manifolds, sizes_of(scene, geometry, ids), counters};
  const Limits limits = limits_of(scene, manifolds.size());
  ErrorBudget budget(scene);
  std::vector<BodyState> now(states.begin(), states.end());
  IslandReport report;
  bool first = true;
  for (std::vector<Part> parts{{dt_s, 0}}; !parts.empty();) {
    const Part part = parts.back();
    parts.pop_back();
    std::optional<PartResult> done =
        advance_part(island, limits, budget, part, now,
                     part.depth == 0 ? manifolds : std::span<const ContactManifold>{});
    if (!done) {
      parts.insert(parts.end(), 2, {0.5 * part.time_s, part.depth + 1});
      continue;
    }
    if (done->trial.failed)
      return advance_unrefined(scene, geometry, dt_s, ids, manifolds, states, counters, faults);
    budget.spend(done->error, part.time_s, ids);
    now = std::move(done->trial.states);
    if (first)
      report = done->trial.report;
    else
      add_part(done->trial.report, report);
    first = false;
  }
  report.static_impulse_newton_s -= push_newton_s(island, dt_s, states);
  budget.tell(report);
  counters.refined_steps += static_cast<std::uint64_t>(island.solves) - 1;
  std::move(now.begin(), now.end(), states.begin());
  return report;
}

IslandReport advance_unrefined(const SceneDescription& scene, const Geometry& geometry, double dt_s,
                               std::span<const BodyId> ids,
                               std::span<const ContactManifold> manifolds,
                               std::span<BodyState> states, StageCounters& counters,
                               std::vector<AdvanceFault>& faults) {
  if (!(scene.tolerance > 0.0))
    return advance_once(scene, dt_s, ids, manifolds, states, counters, faults);
  const std::vector<BodyState> from(states.begin(), states.end());
  IslandReport report = advance_once(scene, dt_s, ids, manifolds, states, counters, faults);
  ErrorBudget budget(scene);
  const BodySizes sizes = sizes_of(scene, geometry, ids);
  budget.spend(larger(change_of(sizes, from, states), displacement_of(sizes, from, states, dt_s)),
               dt_s, ids);
  budget.tell(report);
  return report;
}

IslandReport advance_resting(const SceneDescription& scene, const Geometry& geometry, double dt_s,
                             std::span<const BodyId> ids,
                             std::span<const ContactManifold> manifolds,
                             std::span<BodyState> states, StageCounters& counters,
                             std::vector<AdvanceFault>& faults) {
  return is_refined(scene, geometry, ids, manifolds)
             ? advance_refined(scene, geometry, dt_s, ids, manifolds, states, counters, faults)
             : advance_unrefined(scene, geometry, dt_s, ids, manifolds, states, counters, faults);
}

}  // namespace soda::physics
