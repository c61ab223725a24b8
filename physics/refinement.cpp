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
// eighth of any tolerance.
Limits limits_of(const SceneDescription& scene) {
  return scene.tolerance > 0.0 ? Limits{3000, 26} : Limits{150, 12};
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

// A single step.
PartResult as_it_is(const RefinedIsland& island, std::span<const BodyState> from, Trial one) {
  const StepError error = change_of(island.sizes, from, one.states);
  return {std::move(one), error};
}

// What three trials lead to.
PartResult best_of(const RefinedIsland& island, std::span<const BodyState> from, double time_s,
                   const Trial& one, const Trial& two, Trial four) {
  const BodySizes& sizes = island.sizes;
  const StepError rough = roughness(sizes, from, one.path, two.path, four.path, time_s);
  const StepError of_four = difference_of(sizes, two.states, four.states);
  const StepError of_limit = extrapolation_error(sizes, one.states, two.states, four.states);
  if (of_four.widths < 0.5 * of_limit.widths) return {std::move(four), larger(of_four, rough)};
  Trial limit = extrapolated(one, two, four);
  const double taken = take_back_gain(island, from, limit);
  StepError error = larger(of_limit, rough);
  if (taken > 1.0) return {std::move(four), larger(error, of_four)};
  if (taken > 0.0) error.widths += taken * speed_of(sizes, limit.states).widths;
  return {std::move(limit), error};
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
  PartResult single = as_it_is(island, from, std::move(one));
  const bool last = part.depth == limits.deepest || island.solves >= limits.most_solves;
  if (last || budget.allows(single.error.widths, part.time_s)) return single;
  const Trial two = try_steps(island, from, start, part.time_s, 2);
  Trial four = try_steps(island, from, start, part.time_s, 4);
  if (two.failed || four.failed) return single;
  PartResult best = best_of(island, from, part.time_s, single.trial, two, std::move(four));
  if (!budget.allows(best.error.widths, part.time_s)) return std::nullopt;
  return best;
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
  const Limits limits = limits_of(scene);
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

}  // namespace soda::physics
