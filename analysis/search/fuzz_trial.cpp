#include "analysis/search/fuzz_trial.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "analysis/measures/error_measures.hpp"
#include "analysis/search/energy_change.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/text_table.hpp"
#include "physics/constraints/displacement_bounds.hpp"
#include "physics/integrators/momentum.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/step/step.hpp"

namespace soda::analysis {
namespace {

using namespace physics;

constexpr double kOfSprings = 1e-6;
constexpr double kOfMomentum = 1e-7;  // limits of refined steps leave 2e-9

std::string body_name(const SceneDescription& scene, BodyId id) {
  return "body " + std::to_string(scene.bodies[index_of(id)].label);
}

class Checks {
 public:
  explicit Checks(const scenarios::Scenario& scenario)
      : scene_(scenario.scene), geometry_(scene_), ids_(all_ids(scenario.initial.size())) {
    double largest = 0.0;
    for (std::size_t i = 0; i < ids_.size(); ++i) {
      const BodyState& state = scenario.initial[i];
      radii_m_.push_back(radius_m(scene_.shapes[scene_.bodies[i].shape]));
      fastest_m_s_ = std::max(fastest_m_s_, point_speed(i, state));
      largest = std::max(largest, radii_m_.back());
    }
    // What joints tie to a body turns with it, however far away, and motors drive it.
    const double tied_m = joined_reach_m();
    double lent_joule = 0.0, lightest_kg = 1e300;
    for (std::size_t i = 0; i < ids_.size(); ++i) {
      if (scene_.bodies[i].joints == 0) continue;
      const BodyState& state = scenario.initial[i];
      EnergyChange lent;
      add_elastic(scene_, scenario.initial, scenario.initial, ids_[i], lent);
      lent_joule += lent.scale_joule;
      lightest_kg = std::min(lightest_kg, scene_.bodies[i].mass_kg);
      fastest_m_s_ = std::max(fastest_m_s_,
                              point_speed(i, state) + state.angular_velocity_rad_s.norm() * tied_m);
    }
    fastest_m_s_ = std::max(fastest_m_s_, motor_speed_m_s(tied_m));
    fastest_m_s_ += std::sqrt(2.0 * lent_joule / lightest_kg);
    may_sink_.resize(ids_.size(), false);
    const double duration = scene_.dt_s * static_cast<double>(scenario.run.steps);
    constexpr double kCorrection_1_s = 2.0;
    speed_limit_m_s_ =
        100.0 * (fastest_m_s_ + scene_.gravity_m_s2.norm() * duration + kCorrection_1_s * largest);
  }

  void step(std::int64_t number, std::vector<BodyState>& states) {
    number_ = number;
    const std::vector<BodyState> before = states;
    const std::uint64_t searches = counters_.impact_searches();
    physics::step(scene_, geometry_, ids_, states, {scratch_, report_, counters_});
    for (const AdvanceFault& fault : report_.faults) fail(fault.body, fault.what);
    for (std::size_t i = 0; i < states.size(); ++i)
      fastest_m_s_ = std::max(fastest_m_s_, point_speed(i, before[i]));
    const Islands& islands = scratch_.islands;
    for (std::size_t i = 0; i < islands.count(); ++i) {
      const IslandReport& island = report_.islands[i];
      EnergyChange change;
      for (std::uint32_t k = islands.body_begin[i]; k < islands.body_begin[i + 1]; ++k) {
        const std::uint32_t body = islands.bodies[k];
        add_change(scene_, ids_[body], speed_rounding_m_s(fastest_m_s_, island.contact_points),
                   before[body], states[body], change);
        add_elastic(scene_, before, states, ids_[body], change);
        if (scene_.bodies[body].joints > 0 && island.max_penetration_m > radii_m_[body])
          may_sink_[body] = true;
      }
      const IslandStates of_island = states_of(i, before, states);
      check_island(island, change, of_island);
      check_momentum(island, of_island);
      if (counters_.impact_searches() == searches) check_ways(of_island);
    }
    for (std::size_t i = 0; i < states.size(); ++i) check_place(i, before[i], states[i]);
    for (const std::uint32_t body : islands.free_bodies) {
      EnergyChange change;
      add_change(scene_, ids_[body], speed_rounding_m_s(fastest_m_s_, 0), before[body],
                 states[body], change);
      check_gain(ids_[body], change, "a free body");
    }
    if (has_springs_ && !ids_.empty()) check_balance(ids_.front());
    ++sums_.steps;
  }

  const FuzzSums& sums() const { return sums_; }

 private:
  [[noreturn]] void fail(BodyId id, const std::string& what) const {
    throw CheckFailed("step " + std::to_string(number_) + ", " + body_name(scene_, id) + ": " +
                      what);
  }

  static double radius_m(const Shape& shape) {
    if (const auto* s = std::get_if<Sphere>(&shape)) return s->radius_m;
    if (const auto* s = std::get_if<Box>(&shape)) return s->half_extents_m.norm();
    if (const auto* s = std::get_if<Capsule>(&shape)) return s->radius_m + 0.5 * s->length_m;
    if (const auto* s = std::get_if<Cylinder>(&shape))
      return std::hypot(s->radius_m, 0.5 * s->length_m);
    double squared = 0.0;
    if (const auto* s = std::get_if<ConvexHull>(&shape))
      for (const Vec3& v : s->vertices_m) squared = std::max(squared, v.squaredNorm());
    return std::sqrt(squared);
  }

  // How far from a body's centre others can be that joints hold to it, directly or in turn.
  double joined_reach_m() const {
    double sum = 0.0;
    for (const Joint& joint : scene_.joints) {
      sum += joint.anchor_a_m.norm() + joint.length_m;
      if (joint.b != kWorldBody) sum += joint.anchor_b_m.norm();
      if (joint.limits && joint.kind == JointKind::kSlider)
        sum += std::max(-joint.limits->least, joint.limits->most);
    }
    return sum;
  }

  double motor_speed_m_s(double reach_m) const {
    double most = 0.0;
    for (const Joint& joint : scene_.joints)
      if (joint.motor)
        most += std::abs(joint.motor->speed) * (joint.kind == JointKind::kHinge ? reach_m : 1.0);
    return most;
  }

  double point_speed(std::size_t body, const BodyState& state) const {
    return state.linear_velocity_m_s.norm() + state.angular_velocity_rad_s.norm() * radii_m_[body];
  }

  void check_place(std::size_t body, const BodyState& before, const BodyState& after) {
    const BodyId id = ids_[body];
    if (!(point_speed(body, after) <= speed_limit_m_s_))
      fail(id, "escapes: a point moves at " + format_number(point_speed(body, after)) +
                   " m/s, more than " + format_number(speed_limit_m_s_));
    for (const StaticBody& fixed : scene_.statics) {
      if (!std::holds_alternative<HalfSpace>(scene_.shapes[fixed.shape])) continue;
      const HalfSpace& plane = std::get<HalfSpace>(scene_.shapes[fixed.shape]);
      const auto height = [&](const BodyState& s) {
        return plane.normal.dot(s.position_m - fixed.position_m) - plane.offset_m;
      };
      const double deep = -radii_m_[body];
      if (!may_sink_[body] && height(after) < deep && height(before) >= deep)
        fail(id,
             "escapes: its centre is " + format_number(-height(after)) + " m below " + fixed.name);
    }
  }

  // An island before and after a step.
  struct IslandStates {
    std::vector<BodyId> ids;
    std::vector<BodyState> before, after;
  };

  IslandStates states_of(std::size_t island, const std::vector<BodyState>& before,
                         const std::vector<BodyState>& after) const {
    IslandStates found;
    const Islands& islands = scratch_.islands;
    for (std::uint32_t k = islands.body_begin[island]; k < islands.body_begin[island + 1]; ++k) {
      found.ids.push_back(ids_[islands.bodies[k]]);
      found.before.push_back(before[islands.bodies[k]]);
      found.after.push_back(after[islands.bodies[k]]);
    }
    return found;
  }

  // The most that position correction can lift: each body at its greatest speed, and by as much as
  // its velocity changes, for a body goes on with the old one for a while.
  double most_correction_joule(const IslandStates& island) const {
    const double g = scene_.gravity_m_s2.norm(), dt = scene_.dt_s;
    const double pushed_m_s = fastest_correction(scene_, island.ids).m_s;
    double most = 0.0;
    for (std::size_t i = 0; i < island.ids.size(); ++i) {
      const double changed_m_s =
          (island.after[i].linear_velocity_m_s - island.before[i].linear_velocity_m_s).norm();
      most += scene_.bodies[index_of(island.ids[i])].mass_kg * g * dt *
              (pushed_m_s + changed_m_s + g * dt);
    }
    return most;
  }

  // Where no impact within the step was looked for, no body is faster than twice the fastest of its
  // island before or after, whose spin may have become speed in between. Joints pass on more than
  // that.
  void check_ways(const IslandStates& island) const {
    constexpr double kRoundingOfPlaces = 1e-12;
    constexpr double kOfHeavy = 2.0;  // at which something heavy makes what is light fly off
    const double g = scene_.gravity_m_s2.norm(), dt = scene_.dt_s;
    double fastest_m_s = 0.0;
    for (std::size_t i = 0; i < island.ids.size(); ++i) {
      if (scene_.bodies[index_of(island.ids[i])].joints > 0) return;
      for (const BodyState& state : {island.before[i], island.after[i]})
        fastest_m_s = std::max(
            fastest_m_s, std::sqrt(2.0 * kinetic_joule(scene_, {&island.ids[i], 1}, {&state, 1}) /
                                   scene_.bodies[index_of(island.ids[i])].mass_kg));
    }
    const double most_m_s =
        kOfHeavy * fastest_m_s + g * dt + fastest_correction(scene_, island.ids).m_s;
    for (std::size_t i = 0; i < island.ids.size(); ++i) {
      const double way_m = (island.after[i].position_m - island.before[i].position_m).norm();
      const double most_m = dt * most_m_s + kRoundingOfPlaces * island.before[i].position_m.norm();
      if (!(way_m <= most_m))
        fail(island.ids[i], "way: moves " + format_number(way_m) +
                                " m, though speeds and position correction allow " +
                                format_number(most_m) + " m");
    }
  }

  // An island's momentum changes by what gravity and statics give; without joints, to rounding.
  void check_momentum(const IslandReport& report, const IslandStates& island) {
    for (const BodyId id : island.ids)
      if (scene_.bodies[index_of(id)].joints > 0) return;
    const IslandMomentum was = momentum_of(scene_, island.ids, island.before);
    const IslandMomentum now = momentum_of(scene_, island.ids, island.after);
    const Vec3 weight = was.mass_kg * scene_.dt_s * scene_.gravity_m_s2;
    const Vec3 given = weight + report.static_impulse_newton_s;
    double scale = weight.norm() + report.static_impulse_newton_s.norm();
    for (std::size_t i = 0; i < island.ids.size(); ++i)
      scale += scene_.bodies[index_of(island.ids[i])].mass_kg *
               (island.before[i].linear_velocity_m_s.norm() + fastest_m_s_);
    const double off = (now.linear_newton_s - was.linear_newton_s - given).norm();
    if (!(off <= kOfMomentum * scale))
      fail(report.label, "momentum: off by " + format_number(off) + " N s, " +
                             format_number(off / scale) + " of its scale");
  }

  void check_island(const IslandReport& island, const EnergyChange& change,
                    const IslandStates& states) {
    const double pushed = has_springs_
                              ? island.push_out_work_joule
                              : std::min(island.push_out_work_joule, most_correction_joule(states));
    EnergyChange rest = change;
    rest.gain_joule -= pushed + island.motor_work_joule;
    rest.scale_joule += std::abs(pushed) + std::abs(island.motor_work_joule);
    check_gain(island.label, rest,
               "an island of " + std::to_string(island.bodies) + " with " +
                   std::to_string(island.contact_points) + " points" +
                   (island.direct ? ", solved directly" : ""));
    // Sweeps: 20 rounds of 30 where few rows converge slowly, three times where something bounces
    // or closes, four times with joints; for a single body that in 32 solves and in trials of 1 to
    // 16 steps for each part that is left then, of which there are no more than 14 (12 cuts); for
    // up to 8 bodies in one solve and such trials, and all that in each part between hits. 60
    // impacts and 10 for each body, of 600 sweeps.
    // And up to 80 of Newton's steps for each of 40 corrections. That method stops at 40
    // factorisations, of velocities and of position correction; a full matrix of six rows a body
    // takes a third of its cube. Larger islands are solved once; with joints in 8 parts, each tried
    // again at a half, a quarter and an eighth of its length. And what each solve has for blows
    // (blows.hpp).
    const std::uint64_t trials = 1 + 2 + 4 + 8 + 16, solves = island.bodies > 8 ? 1 : 1 + trials;
    const bool jointed = std::ranges::any_of(
        states.ids, [&](BodyId id) { return scene_.bodies[index_of(id)].joints > 0; });
    const std::uint64_t parts = island.bodies <= 8 ? 9 + 8 * island.bodies : (jointed ? 8 * 4 : 1);
    const std::uint64_t most_iterations =
        (island.bodies == 1 ? (32 + 14 * trials) * 1800 : solves * 8000) * parts +
        (60 + 10 * island.bodies) * 600;
    const std::uint64_t rows = 6 * island.bodies;
    const std::uint64_t of_blows = 200'000 + 3500 * std::uint64_t{island.contact_points};
    const std::uint64_t most_multiplications =
        parts * solves * 80 * rows * rows * rows / 3 + (1 + trials) * of_blows;
    if (island.iterations > most_iterations || island.multiplications > most_multiplications)
      fail(island.label, "work: " + std::to_string(island.iterations) + " iterations and " +
                             std::to_string(island.multiplications) + " multiplications");
    ++sums_.islands;
    sums_.contact_points += island.contact_points;
    sums_.most_iterations = std::max<std::uint64_t>(sums_.most_iterations, island.iterations);
    sums_.most_multiplications = std::max(sums_.most_multiplications, island.multiplications);
    sums_.push_out_work_joule += std::max(0.0, island.push_out_work_joule);
  }

  // Implicit steps over many turns of a spring lose nearly all energy, and may give back some of
  // it: of a scene with springs, the balance over all of the run counts.
  void check_balance(BodyId id) {
    most_joule_ = std::max(most_joule_, now_.scale_joule);
    balance_joule_ += now_.gain_joule;
    now_ = {};
    if (!(balance_joule_ <= kOfSprings * most_joule_))
      fail(id, "energy: all bodies have gained " + format_number(balance_joule_) + " J, " +
                   format_number(balance_joule_ / most_joule_) + " of the most that they had");
    sums_.largest_gain = std::max(sums_.largest_gain, balance_joule_ / (kOfSprings * most_joule_));
  }

  void check_gain(BodyId id, const EnergyChange& change, const std::string& of) {
    if (has_springs_) {
      now_.gain_joule += change.gain_joule;
      now_.scale_joule += change.scale_joule;
      return;
    }
    if (change.scale_joule == 0.0 && change.gain_joule == 0.0) return;
    const double gain = change.gain_joule / (kEnergyRounding * change.scale_joule);
    if (!(gain <= 1.0))
      fail(id, "energy: " + of + " gains " + format_number(change.gain_joule) + " J, " +
                   format_number(change.gain_joule / change.scale_joule) + " of its energies");
    sums_.largest_gain = std::max(sums_.largest_gain, gain);
  }

  const SceneDescription& scene_;
  const Geometry geometry_;
  const std::vector<BodyId> ids_;
  std::vector<double> radii_m_;
  std::vector<bool> may_sink_;  // held by joints, and has been in an island that overlaps so deep
  double fastest_m_s_ = 0.0;    // point that there was so far
  const bool has_springs_ = std::ranges::any_of(
      scene_.joints, [](const Joint& j) { return j.kind == JointKind::kSpring; });
  EnergyChange now_;  // of the step, with springs
  double balance_joule_ = 0.0, most_joule_ = 0.0;
  double speed_limit_m_s_ = 0.0;
  StepScratch scratch_;
  StepReport report_;
  StageCounters counters_;
  std::int64_t number_ = 0;
  FuzzSums sums_;
};

}  // namespace

void add(const FuzzSums& more, FuzzSums& sums) {
  sums.steps += more.steps;
  sums.islands += more.islands;
  sums.contact_points += more.contact_points;
  sums.most_iterations = std::max(sums.most_iterations, more.most_iterations);
  sums.most_multiplications = std::max(sums.most_multiplications, more.most_multiplications);
  sums.largest_gain = std::max(sums.largest_gain, more.largest_gain);
  sums.push_out_work_joule += more.push_out_work_joule;
}

FuzzSums run_fuzz_trial(const scenarios::Scenario& scenario) {
  Checks checks(scenario);
  std::vector<BodyState> states = scenario.initial;
  for (std::int64_t step = 1; step <= scenario.run.steps; ++step) checks.step(step, states);
  return checks.sums();
}

}  // namespace soda::analysis
