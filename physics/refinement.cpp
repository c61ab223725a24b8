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

constexpr std::size_t kFewBodies = 8;  // that are refined unasked

struct Limits {
  int most_solves = 0;
  int deepest = 0;  // cuts
};

// A change is closed in upon until its error, which halves with the part that holds it, is an
// eighth of any tolerance. Large islands take less solves, for each of theirs takes longer.
// Unasked, only a lone body gets more than its trials.
Limits limits_of(const SceneDescription& scene, bool lone, std::size_t pairs) {
  constexpr std::size_t kMostSolves = 2000, kLeastSolves = 64, kPairsSolved = 128'000;
  if (!(scene.tolerance > 0.0)) return lone ? Limits{64, 12} : Limits{0, 0};
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

// The last part that was done.
struct PastPart {
  std::vector<BodyState> from;
  double time_s = 0.0;  // none yet: 0
};

// A part's result, or which share of it comes first when it is cut in two.
struct RefinedPart {
  std::optional<PartResult> result;
  double cut = 0.5;
};

// Whether points change their velocities as gravity could make them do. What changes faster is hit,
// and has no limit.
bool can_be_smooth(const RefinedIsland& island, double time_s, std::span<const BodyState> from,
                   std::span<const BodyState> to) {
  constexpr double kMost = 2.0;
  const double most_m_s = kMost * island.scene.gravity_m_s2.norm() * time_s;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const Vec3 linear = to[i].linear_velocity_m_s - from[i].linear_velocity_m_s;
    const Vec3 angular = to[i].angular_velocity_rad_s - from[i].angular_velocity_rad_s;
    if (!(linear.norm() + island.sizes.bodies[i].radius_m * angular.norm() <= most_m_s))
      return false;
  }
  return true;
}

// What trials lead to: their limit, or the finest where that is nearer.
PartResult best_of(const RefinedIsland& island, std::span<const BodyState> from,
                   const Extrapolation& trials, const Trial& finest) {
  const StepError of_finest = trials.change(island.sizes);
  StepError of_limit = trials.error(island.sizes);
  if (of_finest.widths < 0.5 * of_limit.widths) return {finest, of_finest};
  Trial limit = trials.limit(finest);
  const double taken = take_back_gain(island, from, limit);
  if (taken > 1.0) return {finest, of_finest};
  if (taken > 0.0) of_limit.widths += taken * speed_of(island.sizes, limit.states).widths;
  return {std::move(limit), of_limit};
}

// A single body without joints is advanced by sweeps, which leave nothing.
bool is_lone(const RefinedIsland& island) {
  return island.ids.size() == 1 && std::ranges::none_of(island.pairs, is_joint);
}

// One and two steps over the part, and if forces are not steady four, and more as long as each
// order brings the limit much nearer. No result if that is not within the budget, and the part can
// be cut: at once if two steps of a lone body show that forces change abruptly.
RefinedPart refine_part(RefinedIsland& island, const ErrorBudget& budget, const PastPart& past,
                        double time_s, bool can_be_cut, std::span<const BodyState> from,
                        std::span<const ContactManifold> start, Trial one) {
  constexpr int kMostSteps = 16;
  constexpr double kMuchNearer = 0.125;
  constexpr double kOfTwo = 1e4;     // two trials have to agree by as much more than three
  constexpr double kAbrupt = 0.125;  // of all that changes
  const StepError change = change_of(island.sizes, from, one.states);
  if (budget.allows(change.widths, time_s)) return {PartResult{std::move(one), change}};
  const Trial two = try_steps(island, from, start, time_s, 2);
  if (two.failed) return {PartResult{std::move(one), change}};
  Extrapolation trials(one);
  trials.add(two);
  const StepError unsteady =
      unsteadiness(island.sizes, from, one.states, two.states, two.path, time_s);
  if (budget.allows(kOfTwo * unsteady.widths, time_s)) {
    PartResult best = best_of(island, from, trials, two);
    best.error.widths = unsteady.widths;
    return {std::move(best)};
  }
  double cut = 0.5;
  if (can_be_cut && is_lone(island)) {
    const StepError bend = bend_of(island.sizes, from, two.path);
    cut = share_before_bend(island.sizes, past.from, past.time_s, from, two.path, time_s);
    if (bend.widths > kAbrupt * change.widths) return {std::nullopt, cut};
  }
  Trial finest = try_steps(island, from, start, time_s, 4);
  if (finest.failed) return {PartResult{std::move(one), change}};
  const StepError rough = roughness(island.sizes, from, one.path, two.path, finest.path, time_s);
  double before = trials.error(island.sizes).widths;
  trials.add(finest);
  for (int steps = 8;; steps *= 2) {
    const double now = trials.error(island.sizes).widths;
    PartResult best = best_of(island, from, trials, finest);
    best.error = larger(best.error, rough);
    if (budget.allows(best.error.widths, time_s)) return {std::move(best)};
    const bool nearer = now <= kMuchNearer * before && budget.allows(rough.widths, time_s);
    if (!nearer || steps > kMostSteps) {
      if (can_be_cut) return {std::nullopt, cut};
      const StepError of_finest = larger(trials.change(island.sizes), rough);
      if (now <= kMuchNearer * before) return {std::move(best)};
      return {PartResult{std::move(finest), of_finest}};
    }
    before = now;
    Trial next = try_steps(island, from, start, time_s, steps);
    if (next.failed) return {std::move(best)};
    finest = std::move(next);
    trials.add(finest);
  }
}

// Any other island without a tolerance: `plain` is their step. Trials take its place if they lead
// much nearer to a limit than it is; where they tell of no limit they are no better than it.
PartResult advance_unasked(RefinedIsland& island, const ErrorBudget& budget, double time_s,
                           std::span<const BodyState> from, std::span<const ContactManifold> start,
                           Trial plain) {
  constexpr double kMuchNearer = 0.125;
  const StepError change = change_of(island.sizes, from, plain.states);
  if (budget.allows(change.widths, time_s) || !can_be_smooth(island, time_s, from, plain.states))
    return {std::move(plain), change};
  island.accurate = true;
  Trial one = try_steps(island, from, start, time_s, 1);
  if (one.failed) return {std::move(plain), change};
  PartResult refined =
      *refine_part(island, budget, {}, time_s, false, from, start, std::move(one)).result;
  const StepError apart = apart_of(island.sizes, plain.states, refined.trial.states);
  if (!(refined.error.widths <= kMuchNearer * apart.widths)) return {std::move(plain), apart};
  return refined;
}

RefinedPart advance_part(RefinedIsland& island, const Limits& limits, const ErrorBudget& budget,
                         const PastPart& past, const Part& part, std::span<const BodyState> from,
                         std::span<const ContactManifold> known) {
  std::vector<ContactManifold> found;
  if (known.empty()) contacts_at(island, part.time_s, from, found);
  const std::span<const ContactManifold> start = known.empty() ? found : known;
  Trial one = try_steps(island, from, start, part.time_s, 1);
  if (one.failed) return {PartResult{std::move(one), {}}};
  if (!(island.scene.tolerance > 0.0) && !is_lone(island))
    return {advance_unasked(island, budget, part.time_s, from, start, std::move(one))};
  const bool can_be_cut = part.depth < limits.deepest && island.solves < limits.most_solves;
  return refine_part(island, budget, past, part.time_s, can_be_cut, from, start, std::move(one));
}

bool has_pushed(const SceneDescription& scene, std::span<const BodyId> ids) {
  return std::ranges::any_of(ids,
                             [&scene](BodyId id) { return is_pushed(scene.bodies[index_of(id)]); });
}

// Whether trials have a limit that a plain step is not near already: contacts without joints but
// springs. (Springs alone are of a higher order, or so stiff that their limit is not smooth.)
bool is_of_first_order(const SceneDescription& scene, std::span<const ContactManifold> manifolds) {
  if (scene.joints.empty() || std::ranges::none_of(manifolds, is_joint)) return true;
  for (const ContactManifold& m : manifolds)
    if (is_joint(m) && scene.joints[joint_of(m)].kind != JointKind::kSpring) return false;
  return std::ranges::any_of(manifolds, [](const ContactManifold& m) { return m.count > 0; });
}

}  // namespace

std::vector<ContactManifold> found_again(const SceneDescription& scene, const Geometry& geometry,
                                         double dt_s, std::span<const BodyId> ids,
                                         std::span<const ContactManifold> manifolds,
                                         std::span<const BodyState> states,
                                         StageCounters& counters) {
  std::vector<ContactManifold> found;
  contacts_at({scene, geometry, ids, manifolds, {}, counters}, dt_s, states, found);
  return found;
}

bool is_refined(const SceneDescription& scene, const Geometry& geometry,
                std::span<const BodyId> ids, std::span<const ContactManifold> manifolds) {
  if (!(scene.tolerance > 0.0)) {
    if (ids.size() > kFewBodies) return false;
    if (has_pushed(scene, ids) || !is_of_first_order(scene, manifolds)) return false;
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
  RefinedIsland island{scene,
                       geometry,
                       ids,
                       manifolds,
                       sizes_of(scene, geometry, ids),
                       counters,
                       scene.tolerance > 0.0};
  const Limits limits = limits_of(scene, is_lone(island), manifolds.size());
  ErrorBudget budget(scene);
  std::vector<BodyState> now(states.begin(), states.end());
  PastPart past;
  IslandReport report;
  bool first = true;
  for (std::vector<Part> parts{{dt_s, 0}}; !parts.empty();) {
    const Part part = parts.back();
    parts.pop_back();
    RefinedPart done =
        advance_part(island, limits, budget, past, part, now,
                     part.depth == 0 ? manifolds : std::span<const ContactManifold>{});
    if (!done.result) {
      const double first_s = done.cut * part.time_s;
      parts.push_back({part.time_s - first_s, part.depth + 1});
      parts.push_back({first_s, part.depth + 1});
      continue;
    }
    PartResult& result = *done.result;
    if (result.trial.failed)
      return advance_unrefined(scene, geometry, dt_s, ids, manifolds, states, counters, faults);
    budget.spend(result.error, part.time_s, ids);
    past = {std::exchange(now, std::move(result.trial.states)), part.time_s};
    if (first)
      report = result.trial.report;
    else
      add_part(result.trial.report, report);
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
  SolveScratch scratch;
  if (!(scene.tolerance > 0.0))
    return advance_once(scene, dt_s, false, ids, manifolds, states, scratch, counters, faults);
  const std::vector<BodyState> from(states.begin(), states.end());
  IslandReport report =
      advance_once(scene, dt_s, true, ids, manifolds, states, scratch, counters, faults);
  ErrorBudget budget(scene);
  const BodySizes sizes = sizes_of(scene, geometry, ids);
  budget.spend(larger(change_of(sizes, from, states), displacement_of(sizes, from, states, dt_s)),
               dt_s, ids);
  budget.tell(report);
  return report;
}

}  // namespace soda::physics
