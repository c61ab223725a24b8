#include "physics/events/event_driven_impacts.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>

#include "physics/continuous/time_of_impact.hpp"
#include "physics/events/meeting_pairs.hpp"
#include "physics/events/resolve_impact.hpp"
#include "physics/forces/forces.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/model/body_places.hpp"
#include "physics/model/contact_manifold.hpp"
#include "physics/model/kinematic.hpp"
#include "physics/model/stage_counters.hpp"
#include "physics/shapes/geometry.hpp"

namespace soda::physics {
namespace {

double opening_m_s(const ContactManifold& m, const ContactPoint& p, const BodyState& a,
                   const BodyState* b) {
  const Vec3 other = b == nullptr ? Vec3(Vec3::Zero()) : velocity_at(*b, p.position_m);
  return (other - velocity_at(a, p.position_m)).dot(m.normal);
}

// At a point that neither bounces nor leaves, its field presses a body on what holds, or two
// overlap.
bool rests(const IslandStep& island, const ContactManifold& m, const BodyState& a,
           const BodyState* b) {
  const SceneDescription& scene = island.scene;
  const double touching_m = touching_gap_m(scene, island.geometry, m.a, a, m.b);
  const double presses = -relative_field(scene, m.a, m.b).dot(m.normal);
  const bool pressed = is_approach(0.5 * presses * scene.dt_s * scene.dt_s,
                                   width_of(scene, island.geometry, m.a, m.b));
  const double present_m = pressed ? touching_m : -2.0 * touching_m;
  for (std::uint32_t i = 0; i < m.count; ++i) {
    const ContactPoint& p = m.points[i];
    if (p.separation_m > present_m) continue;
    if (std::abs(opening_m_s(m, p, a, b)) <= scene.solver.restitution_threshold_m_s) return true;
  }
  return false;
}

bool can_fly(const BodyParams& body) { return can_be_unjointed(body) && !is_pushed(body); }

// What happens at an impact within the step is worth its time: the pair bounces, or flies farther
// than its width.
bool is_impact(const SceneDescription& scene, const ContactManifold& m) {
  const Material &a = material_of(scene, m.a), &b = material_of(scene, m.b);
  return std::max(a.restitution, b.restitution) > 0.0 || m.points[0].feature == kDistanceToImpact;
}

}  // namespace

Need flights_needed(const SceneDescription& scene) {
  const Need contacts = contacts_needed(scene);
  const std::size_t flyers = bodies_that(scene, can_fly);
  if (!contacts) return contacts;
  if (flyers == 0) return {false, "every body is driven, pushed or held by a joint"};
  return need_of(can_meet(flyers, scene.statics.size()), "bodies can fly into each other",
                 "one body can fly, and there is nothing to fly into");
}

bool is_in_flight(const IslandStep& island, std::span<const BodyState> states) {
  const auto& [scene, geometry, dt_s, ids, manifolds] = island;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const BodyParams& body = scene.bodies[index_of(ids[i])];
    if (!can_fly(body) || !is_unjointed(body, states[i])) return false;
  }
  const auto state_of = [&](BodyId id) { return &states[place_of(island.ids, id)]; };
  bool impact = false;
  for (const ContactManifold& m : manifolds) impact = impact || is_impact(scene, m);
  if (!impact) return false;
  for (const ContactManifold& m : manifolds) {
    const BodyState& a = *state_of(m.a);
    const BodyState* const b = is_static(m.b) ? nullptr : state_of(m.b);
    if (rests(island, m, a, b)) return false;
  }
  return true;
}

namespace {

struct Flyers : IslandStep {
  std::vector<BodyState> states;  // each as of its own time
  std::vector<double> since_s;
  MeetingPairs pairs;
  NextPair next;
  std::vector<bool> lasts;  // by pair, of what is next
  std::vector<bool> slow;   // by pair, whether it has met without bouncing

  BodyState at(std::uint32_t body, double time_s) const {
    const double passed = time_s - since_s[body];
    return passed > 0.0 ? flown(scene, ids[body], states[body], passed) : states[body];
  }
  BodyId other(const MeetingPair& pair) const {
    return pair.fixed ? static_id(pair.b) : ids[pair.b];
  }
};

void expect(Flyers& flyers, std::uint32_t pair, const std::optional<Impact>& impact) {
  flyers.lasts.resize(std::max(flyers.lasts.size(), flyers.pairs.size()));
  flyers.slow.resize(flyers.lasts.size());
  flyers.lasts[pair] = impact && impact->lasts;
  flyers.next.set(flyers.pairs, pair, impact ? impact->time_s : kNever);
}

void look_ahead(Flyers& flyers, std::uint32_t number, StageCounters& counters) {
  if (!flyers.pairs.are_near(number)) return expect(flyers, number, {});
  const MeetingPair pair = flyers.pairs[number];
  const double begin = pair.fixed ? flyers.since_s[pair.a]
                                  : std::max(flyers.since_s[pair.a], flyers.since_s[pair.b]);
  const BodyState a = flyers.at(pair.a, begin);
  const BodyState b = pair.fixed ? BodyState{} : flyers.at(pair.b, begin);
  std::optional<Impact> impact =
      time_of_impact({flyers.scene, flyers.geometry, flyers.dt_s - begin, flyers.ids[pair.a], a,
                      flyers.other(pair), pair.fixed ? nullptr : &b});
  if (impact) impact->time_s += begin;
  expect(flyers, number, impact);
  ++counters.flight_searches;
}

// The points at which the pair touches now, with no gap left.
std::vector<ContactManifold> touching_points(const Flyers& flyers, const MeetingPair& pair,
                                             const BodyState& a, const BodyState* b,
                                             StageCounters& counters) {
  std::vector<ContactManifold> found;
  const BodyId id_a = flyers.ids[pair.a], id_b = flyers.other(pair);
  collide({flyers.scene, flyers.geometry, 0.0, id_a, a, id_b, b}, found, counters);
  // The point that the impact was found at belongs to it, whatever two ways to find it differ by.
  double nearest = found.empty() ? 0.0 : least_separation_m(found.front());
  for (const ContactManifold& m : found) nearest = std::min(nearest, least_separation_m(m));
  const double touching =
      std::max(nearest, 0.0) + 2.0 * touching_gap_m(flyers.scene, flyers.geometry, id_a, a, id_b);
  for (ContactManifold& m : found) {
    std::uint32_t kept = 0;
    for (std::uint32_t i = 0; i < m.count; ++i) {
      if (m.points[i].separation_m > touching) continue;
      m.points[kept] = m.points[i];
      m.points[kept++].separation_m = std::min(m.points[i].separation_m, 0.0);
    }
    m.count = kept;
  }
  std::erase_if(found, [](const ContactManifold& m) { return m.count == 0; });
  return found;
}

double fastest_approach_m_s(std::span<const ContactManifold> manifolds, const BodyState& a,
                            const BodyState* b) {
  double fastest = -std::numeric_limits<double>::infinity();
  for (const ContactManifold& m : manifolds)
    for (std::uint32_t i = 0; i < m.count; ++i)
      fastest = std::max(fastest, -opening_m_s(m, m.points[i], a, b));
  return fastest;
}

// Changes the velocities of the pair at `time_s`. False if nothing changed, or the pair rests,
// rolls or slides: it has met without bouncing, and does so again with nothing in between.
bool resolve_impact_of_pair(Flyers& flyers, std::uint32_t number, double time_s,
                            IslandReport& report, StageCounters& counters) {
  const MeetingPair& pair = flyers.pairs[number];
  std::vector<BodyId> ids{flyers.ids[pair.a]};
  std::vector<BodyState> states{flyers.at(pair.a, time_s)};
  if (!pair.fixed) {
    ids.push_back(flyers.ids[pair.b]);
    states.push_back(flyers.at(pair.b, time_s));
  }
  const std::vector<ContactManifold> manifolds =
      touching_points(flyers, pair, states[0], pair.fixed ? nullptr : &states[1], counters);
  if (manifolds.empty()) return false;
  if (!(fastest_approach_m_s(manifolds, states[0], pair.fixed ? nullptr : &states[1]) >
        flyers.scene.solver.restitution_threshold_m_s)) {
    if (flyers.slow[number]) return false;
    flyers.slow[number] = true;
  }
  const bool changed = resolve_impact(flyers.scene, ids, manifolds, states, report, counters);
  for (std::size_t i = 0; i < states.size(); ++i) {
    const std::uint32_t body = i == 0 ? pair.a : pair.b;
    if (is_kinematic(flyers.scene, ids[i])) continue;
    flyers.states[body] = std::move(states[i]);
    flyers.since_s[body] = time_s;
  }
  return changed;
}

// From the beginning, of which the contacts may know already.
void look_at_first(Flyers& flyers, std::uint32_t number, StageCounters& counters) {
  const std::span<const ContactManifold> manifolds = flyers.manifolds;
  const MeetingPair& pair = flyers.pairs[number];
  ContactManifold of_pair;
  of_pair.a = flyers.ids[pair.a];
  of_pair.b = flyers.other(pair);
  const auto known =
      std::lower_bound(manifolds.begin(), manifolds.end(), of_pair, canonical_before);
  if (known != manifolds.end() && !canonical_before(of_pair, *known) && known->impact_s > 0.0)
    expect(flyers, number, Impact{known->impact_s, false});
  else
    look_ahead(flyers, number, counters);
}

// The two are on other paths now, except what is kinematic; pairs with others begin anew.
void redirect(Flyers& flyers, std::uint32_t hit, StageCounters& counters) {
  const MeetingPair pair = flyers.pairs[hit];
  std::vector<std::uint32_t> bodies;
  if (!is_kinematic(flyers.scene, flyers.ids[pair.a])) bodies.push_back(pair.a);
  if (!pair.fixed && !is_kinematic(flyers.scene, flyers.ids[pair.b])) bodies.push_back(pair.b);
  for (const std::uint32_t body : bodies)
    flyers.pairs.redirect(body, flyers.states[body],
                          (flyers.dt_s - flyers.since_s[body]) / flyers.scene.dt_s, counters);
  for (const std::uint32_t body : bodies)
    for (const std::uint32_t other : flyers.pairs.of(body))
      if (other != hit) {
        look_ahead(flyers, other, counters);
        flyers.slow[other] = false;
      }
  if (!bodies.empty()) look_ahead(flyers, hit, counters);
}

// Through impacts until dt_s, or until something lasts.
double fly(Flyers& flyers, IslandReport& report, StageCounters& counters) {
  const std::size_t most_impacts = 60 + 10 * flyers.ids.size();
  for (std::uint32_t pair = 0; pair < flyers.pairs.size(); ++pair)
    look_at_first(flyers, pair, counters);
  for (std::size_t impacts = 0;; ++impacts) {
    const double now = flyers.next.first_s();
    if (now == kNever) return flyers.dt_s;
    if (impacts == most_impacts) {
      ++counters.islands_over_budget;
      report.beyond_tolerance = flyers.scene.tolerance > 0.0;
      return now;
    }
    const std::uint32_t number = flyers.next.take_first();
    if (flyers.lasts[number] || !resolve_impact_of_pair(flyers, number, now, report, counters))
      return now;
    redirect(flyers, number, counters);
  }
}

}  // namespace

double fly_through_impacts(const IslandStep& island, std::span<BodyState> states,
                           IslandReport& report, StageCounters& counters) {
  if (!is_in_flight(island, states)) return 0.0;
  const std::span<const BodyId> ids = island.ids;
  Flyers flyers{island,
                {states.begin(), states.end()},
                std::vector<double>(ids.size(), 0.0),
                MeetingPairs(island.scene, island.geometry, ids, states, counters),
                {},
                {},
                {}};
  IslandReport flight = report;
  const double reached = fly(flyers, flight, counters);
  if (!(reached > 0.0)) return 0.0;
  std::vector<BodyState> next;
  for (std::uint32_t i = 0; i < ids.size(); ++i) {
    next.push_back(flyers.at(i, reached));
    next.back().impulses.clear();
    if (*fault_of(next.back())) return 0.0;
  }
  std::move(next.begin(), next.end(), states.begin());
  report = flight;
  return reached;
}

}  // namespace soda::physics
