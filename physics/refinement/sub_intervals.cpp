#include "physics/refinement/sub_intervals.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "physics/constraints/rolling_rows.hpp"
#include "physics/forces/forces.hpp"
#include "physics/integrators/explicit_springs.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/model/body_places.hpp"
#include "physics/model/kinematic.hpp"
#include "physics/refinement/friction_reversals.hpp"
#include "physics/refinement/refinement.hpp"

namespace soda::physics {

bool is_single_body(const RefinedIsland& island) {
  return island.ids.size() == 1 &&
         (!island.springs.empty() || std::ranges::none_of(island.manifolds, is_joint));
}

bool is_asked(const RefinedIsland& island) { return island.scene.tolerance > 0.0; }

namespace {

// The largest friction that a single body meets; rolling friction as that at its radius.
double friction_of_single_body(const RefinedIsland& island) {
  const Material& own = material_of(island.scene, island.ids.front());
  double most = 0.0, rolling_m = 0.0;
  for (const ContactManifold& m : island.manifolds) {
    if (!is_static(m.b) || is_joint(m)) continue;
    const Material& other = material_of(island.scene, m.b);
    most = std::max(most, other.friction);
    const RollingFriction rolling = rolling_friction(own, other);
    rolling_m = std::max({rolling_m, rolling.rolling_m, rolling.torsional_m});
  }
  return std::sqrt(own.friction * most) + rolling_m / island.sizes.bodies[0].radius_m;
}

// What gives a body velocity besides its field and contacts.
double pushed_m_s_of(const RefinedIsland& island, double time_s, std::size_t body,
                     const BodyState& from) {
  const BodyParams& params = island.scene.bodies[index_of(island.ids[body])];
  if (!is_pushed(params)) return 0.0;
  return push_impulse_newton_s(island.scene, time_s, island.ids[body], from).norm() /
         params.mass_kg;
}

// Whether points change their velocities as fields and pushes could make them do. What changes
// faster is hit, and has no limit. Friction turns what it stops: by 3.5 times itself in a sphere.
bool can_be_smooth(const RefinedIsland& island, double time_s, std::span<const BodyState> from,
                   std::span<const BodyState> to) {
  constexpr double kMost = 2.0, kOfFriction = 4.0;
  const double most =
      kMost + (is_single_body(island) ? kOfFriction * friction_of_single_body(island) : 0.0);
  const double most_m_s = most * strongest_field_m_s2(island.scene, island.ids) * time_s;
  std::vector<double> by_springs_m_s;  // none without springs
  if (!island.springs.empty())
    by_springs_m_s = most_changed_by_springs_m_s(island.scene, time_s, island.ids, island.springs,
                                                 island.sizes, from);
  for (std::size_t i = 0; i < from.size(); ++i) {
    const Vec3 linear = to[i].linear_velocity_m_s - from[i].linear_velocity_m_s;
    const Vec3 angular = to[i].angular_velocity_rad_s - from[i].angular_velocity_rad_s;
    const double change_m_s = linear.norm() + island.sizes.bodies[i].radius_m * angular.norm();
    const double pushed_m_s = kMost * pushed_m_s_of(island, time_s, i, from[i]);
    if (!(change_m_s <= most_m_s + pushed_m_s + (by_springs_m_s.empty() ? 0.0 : by_springs_m_s[i])))
      return false;
  }
  return true;
}

// Whether a point comes to another faster than fields make things in two such times.
bool comes_fast(const RefinedIsland& island, const StartedSubInterval& part) {
  const double most_m_s = 2.0 * strongest_field_m_s2(island.scene, island.ids) * part.time_s;
  const auto at = [&](BodyId id) -> const BodyState& {
    return part.from[place_of(island.ids, id)];
  };
  for (const ContactManifold& m : part.start)
    for (std::uint32_t i = 0; i < m.count; ++i) {
      const ContactPoint& point = m.points[i];
      Vec3 closing = velocity_at(at(m.a), point.position_m);
      if (!is_static(m.b)) closing -= velocity_at(at(m.b), point.position_m);
      if (closing.dot(m.normal) > most_m_s) return true;
    }
  return false;
}

// Whether a single body is hit, and one step stands: its contacts are solved, and it turns so
// little that those of its start are those of the part.
bool is_plain_hit(const RefinedIsland& island, double time_s, std::span<const BodyState> from,
                  const Trial& one) {
  constexpr double kMostRotation_rad = 0.25, kMostLeft = 1e-4;  // of the width
  const std::span<const BodyState> to = one.states;
  if (can_be_smooth(island, time_s, from, to)) return false;
  const double angular_speed_rad_s =
      std::max(from[0].angular_velocity_rad_s.norm(), to[0].angular_velocity_rad_s.norm());
  return angular_speed_rad_s * time_s <= kMostRotation_rad &&
         one.report.constraint_residual_m_s * time_s <= kMostLeft * island.sizes.bodies[0].width_m;
}

// What trials lead to: their limit, or the finest where that is nearer.
SubIntervalResult best_of(const RefinedIsland& island, std::span<const BodyState> from,
                          const RichardsonExtrapolation& trials, const Trial& finest) {
  const StepError of_finest = trials.change(island.sizes);
  StepError of_limit = trials.error(island.sizes);
  const bool is_finest_nearer = of_finest.relative_error < 0.5 * of_limit.relative_error;
  if (is_finest_nearer && island.springs.empty()) return {finest, of_finest};
  Trial limit = trials.limit(finest);
  const double taken = take_back_gain(island, from, limit);
  if (taken > 1.0) return {finest, of_finest};
  if (taken > 0.0)
    of_limit.relative_error += taken * speed_of(island.sizes, limit.states).relative_error;
  return {std::move(limit), of_limit, true};
}

// Steps with explicit springs give energy and take it: only their limit does neither.
bool is_fit(const RefinedIsland& island, const SubIntervalResult& result) {
  return result.is_limit || island.springs.empty();
}

// Where a single body's forces change, told by two steps. A jump of the velocity at the start of
// the part bends its half as much as the whole: then next to nothing comes first.
Bisection bisection_at_change(const RefinedIsland& island, const StartedSubInterval& part,
                              const Trial& two, double bend) {
  constexpr double kAsMuch = 0.25;  // but for that share
  if (!is_asked(island) && part.bend > 0.0 && std::abs(bend - part.bend) < kAsMuch * part.bend) {
    const int halvings = island.limits.deepest - part.depth;
    return {std::ldexp(1.0, -halvings), halvings, 0.0};
  }
  if (!island.springs.empty()) return {0.5, 1, bend};  // no line, but a curve
  const PastSubInterval& past = island.past;
  return {share_before_bend(island.sizes, past.from, past.time_s, part.from, two.path, part.time_s),
          1, bend};
}

// Where friction turns round or ends: the first part ends there, and the other begins. Of several
// bodies without a tolerance only where that is worth a part.
std::optional<Bisection> bisection_at_reversal(RefinedIsland& island,
                                               const StartedSubInterval& part, const Trial& one) {
  constexpr double kWorthAPart = 1e-6;  // widths
  const StepError turned = reversal_error(island, part.start, part.from, one.states);
  if (island.budget.allows(turned.relative_error, part.time_s)) return {};
  if (!is_asked(island) && !is_single_body(island) && turned.relative_error < kWorthAPart)
    return {};
  const std::optional<double> share =
      share_before_reversal(island, part.time_s, part.start, part.from, one.states);
  if (!share) return {};
  return Bisection{*share};
}

// What trials told of a part, in widths.
struct Course {
  std::optional<Bisection> cut = {};  // to be made where they do not do; none where none can be
  double before = 0.0, now = 0.0;     // what the last two orders changed
  double rough = 0.0, bend = 0.0, change = 0.0;
  int steps = 0;  // of the next trial

  bool comes_nearer() const {
    constexpr double kMuchNearer = 0.125;
    return now <= kMuchNearer * before;
  }
  // Forces that change at any place within bend velocities by no more than twelve times what that
  // leaves rough.
  bool is_smooth(double share_of_step) const {
    constexpr double kOfBend = 1.0 / 16.0, kLeastBend = 1.0 / 1024.0;
    return comes_nearer() && rough <= kOfBend * std::max(bend, kLeastBend * change) * share_of_step;
  }
};

enum class Next { kMoreSteps, kCut, kEnough };

// Without a tolerance, smooth motion of a single body gets more where that is expected to be all
// that it needs: twice the steps, or once a cut in halves, whose limits are of the fifth order.
// Where springs are explicit, more steps bring it nearer in any case. `fit`: whether what there is
// would do.
Next next_for(const RefinedIsland& island, const SubInterval& part, const Course& course,
              bool fit) {
  constexpr int kMostSteps = 16;
  const auto reaches = [&](double limit, double rough) {
    return island.budget.allows(limit, part.time_s) && island.budget.allows(rough, part.time_s);
  };
  const bool more = course.steps <= kMostSteps;
  if (!fit && more) return Next::kMoreSteps;
  if (!is_asked(island) && (is_single_body(island) || !island.springs.empty()) &&
      course.is_smooth(part.time_s / island.sizes.dt_s)) {
    const double hoped = course.now * course.now / course.before;
    if (more && reaches(hoped, course.rough)) return Next::kMoreSteps;
    const bool halves =
        is_single_body(island) && part.depth == 0 && reaches(hoped / 32.0, course.rough / 16.0);
    if (halves) return Next::kCut;
    return more && !island.springs.empty() ? Next::kMoreSteps : Next::kEnough;
  }
  return more && course.comes_nearer() && reaches(0.0, course.rough) ? Next::kMoreSteps
                                                                     : Next::kCut;
}

// Four steps over the part after one and two, and more as long as that is worth it. No result if
// their limit is not within the budget, and the part is to be cut.
RefinedSubInterval refine_further(RefinedIsland& island, const StartedSubInterval& part,
                                  RichardsonExtrapolation& trials, const Trial& one,
                                  const Trial& two, Course course) {
  const std::span<const BodyState> from = part.from;
  Trial finest = try_steps(island, from, part.start, part.time_s, 4);
  if (finest.failed) return {SubIntervalResult{one, {course.change, 0}}};
  const StepError rough =
      roughness_indicator(island.sizes, from, one.path, two.path, finest.path, part.time_s);
  course.rough = rough.relative_error;
  course.before = trials.error(island.sizes).relative_error;
  trials.add(finest);
  for (course.steps = 8;; course.steps *= 2) {
    course.now = trials.error(island.sizes).relative_error;
    SubIntervalResult best = best_of(island, from, trials, finest);
    best.error = larger(best.error, rough);
    const bool fit = is_fit(island, best);
    if (fit && island.budget.allows(best.error.relative_error, part.time_s))
      return {std::move(best)};
    const Next next = next_for(island, part, course, fit);
    if (next == Next::kCut && course.cut) return {std::nullopt, *course.cut};
    if (next != Next::kMoreSteps) {
      if (course.comes_nearer()) return {std::move(best)};
      const StepError of_finest = larger(trials.change(island.sizes), rough);
      return {SubIntervalResult{std::move(finest), of_finest}};
    }
    course.before = course.now;
    Trial more = try_steps(island, from, part.start, part.time_s, course.steps);
    if (more.failed) return {std::move(best)};
    finest = std::move(more);
    trials.add(finest);
  }
}

// One step that is all: what joints turn need not be of first order.
Trial uncompared(RefinedIsland& island, const StartedSubInterval& part, Trial one,
                 const StepError& change) {
  if (!(change.relative_error > 0.0) || std::ranges::none_of(island.manifolds, is_joint))
    return one;
  const Exactness how = std::exchange(island.how, Exactness::kAccurate);
  Trial alone = try_steps(island, part.from, part.start, part.time_s, 1);
  island.how = how;
  return alone.failed ? one : alone;
}

// One and two steps over the part, and more if forces are not steady. No result if their limit is
// not within the budget, and the part can be cut: at once if two steps of a single body show that
// forces change abruptly.
RefinedSubInterval refine_sub_interval(RefinedIsland& island, const StartedSubInterval& part,
                                       Trial one) {
  constexpr double kOfTwo = 1e4;  // two trials have to agree by as much more than three
  // Of all that changes. Without a tolerance two more trials tell what is just swift.
  const double abrupt = is_asked(island) ? 0.125 : 0.25;
  const Limits& limits = island.limits;
  const bool can_be_cut = part.depth < limits.deepest && island.solves < limits.most_solves;
  const StepError change = change_of(island.sizes, part.from, one.states);
  // Explicit springs push to and fro: velocities may end as they began.
  if (island.springs.empty() && island.budget.allows(change.relative_error, part.time_s))
    return {SubIntervalResult{uncompared(island, part, std::move(one), change), change}};
  if (can_be_cut)
    if (const std::optional<Bisection> reversal = bisection_at_reversal(island, part, one))
      return {std::nullopt, *reversal};
  const Trial two = try_steps(island, part.from, part.start, part.time_s, 2);
  if (two.failed) return {SubIntervalResult{std::move(one), change}};
  RichardsonExtrapolation trials(one);
  trials.add(two);
  const StepError unsteady = unsteadiness_indicator(island.sizes, part.from, one.states, two.states,
                                                    two.path, part.time_s);
  // Friction that springs overcome at the end of a swing can stop a body at the end of both.
  if (island.springs.empty() &&
      island.budget.allows(kOfTwo * unsteady.relative_error, part.time_s)) {
    SubIntervalResult best = best_of(island, part.from, trials, two);
    best.error.relative_error = unsteady.relative_error;
    return {std::move(best)};
  }
  Course course{.change = change.relative_error};
  std::optional<Bisection>& cut = course.cut;
  if (can_be_cut) cut.emplace();
  if (is_single_body(island) || !island.springs.empty())
    course.bend = bend_indicator(island.sizes, part.from, two.path).relative_error;
  if (is_single_body(island)) {
    if (cut) cut = bisection_at_change(island, part, two, course.bend);
    if (cut && course.bend > abrupt * change.relative_error) return {std::nullopt, *cut};
  }
  return refine_further(island, part, trials, one, two, course);
}

// Any other island without a tolerance: `plain` is their step. Trials take its place if they lead
// much nearer to a limit than it is; where they tell of no limit they are no better than it. What
// is hit has none; but where nothing comes fast, it is the plain step that throws, unless the most
// accurate one does the same. The limits of such an island allow no cut.
SubIntervalResult advance_unasked(RefinedIsland& island, const StartedSubInterval& part,
                                  Trial plain) {
  constexpr double kMuchNearer = 0.125;
  const StepError change = change_of(island.sizes, part.from, plain.states);
  if (part.time_s < kShort * island.scene.dt_s ||
      island.budget.allows(change.relative_error, part.time_s))
    return {std::move(plain), change};
  const bool smooth = can_be_smooth(island, part.time_s, part.from, plain.states);
  if (!smooth && comes_fast(island, part)) return {std::move(plain), change};
  island.how = Exactness::kCompared;
  Trial one = try_steps(island, part.from, part.start, part.time_s, 1);
  if (one.failed) return {std::move(plain), change};
  if (!smooth && !(apart_of(island.sizes, plain.states, one.states).relative_error > 0.0))
    return {std::move(plain), change};
  SubIntervalResult refined = *refine_sub_interval(island, part, std::move(one)).result;
  const StepError apart = apart_of(island.sizes, plain.states, refined.trial.states);
  if (!(refined.error.relative_error <= kMuchNearer * apart.relative_error))
    return {std::move(plain), apart};
  return refined;
}

RefinedSubInterval try_sub_interval(RefinedIsland& island, const StartedSubInterval& part) {
  constexpr int kMostReversals = 2;  // of friction on several bodies, without a tolerance
  const std::span<const BodyState> from = part.from;
  Trial one = try_steps(island, from, part.start, part.time_s, 1);
  if (one.failed) return {SubIntervalResult{std::move(one), {}}};
  if (!is_asked(island)) {
    if (!is_single_body(island)) {
      if (part.depth < kMostReversals && can_be_smooth(island, part.time_s, from, one.states))
        if (const std::optional<Bisection> reversal = bisection_at_reversal(island, part, one))
          return {std::nullopt, *reversal};
      return {advance_unasked(island, part, std::move(one))};
    }
    if (is_plain_hit(island, part.time_s, from, one))
      return {SubIntervalResult{one, change_of(island.sizes, from, one.states)}};
  }
  return refine_sub_interval(island, part, std::move(one));
}

}  // namespace

RefinedSubInterval advance_sub_interval(RefinedIsland& island, const SubInterval& part,
                                        std::span<const BodyState> from,
                                        std::span<const ContactManifold> known) {
  std::vector<ContactManifold> found;
  if (known.empty()) contacts_at(island, part.time_s, from, found);
  const std::span<const ContactManifold> start = known.empty() ? found : known;
  RefinedSubInterval done = try_sub_interval(island, {part, from, start});
  if (!done.result || is_fit(island, *done.result)) return done;
  JointSystem springs = std::exchange(island.springs, {});
  Trial implicit = try_steps(island, from, start, part.time_s, 1);
  island.springs = std::move(springs);
  const StepError change = change_of(island.sizes, from, implicit.states);
  return {SubIntervalResult{std::move(implicit), change}};
}

}  // namespace soda::physics
