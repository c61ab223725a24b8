#include "physics/events/contact_impact_run.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/events/meeting_pairs.hpp"
#include "physics/events/resolve_impact.hpp"
#include "physics/forces/forces.hpp"
#include "physics/integrators/advance_once.hpp"
#include "physics/model/body_places.hpp"
#include "physics/refinement/advance_apart.hpp"
#include "physics/refinement/advance_resting.hpp"
#include "physics/shapes/geometry_impl.hpp"

namespace soda::physics {
namespace {

// What hits that are known to come may take once each, in bodies and contact points that are
// advanced: more, and a large set that contacts hold would be advanced again and again, each time
// for one hit. A set of several bodies is solved by iteration, which takes that many times what one
// body takes.
constexpr std::size_t kIterated = 8;
std::size_t most_ahead(std::size_t bodies) { return 1280 + 16 * bodies; }

// What all of them may take, as it is counted: in iterations over a row. As much as so many
// multiplications of a factorisation, and as a part of a look at a pair.
constexpr double kMultiplicationsOfRow = 16.0, kRowsOfLook = 2.0;
double most_work(std::size_t bodies) { return 2e4 + 1e3 * static_cast<double>(bodies); }

}  // namespace

ContactImpactRun::ContactImpactRun(const ContactImpactIsland& island, bool apart,
                                   std::span<BodyState> states, IslandReport& report,
                                   const IslandEffects& effects)
    : island_(island),
      apart_(apart),
      states_(states),
      report_(report),
      effects_(effects),
      pairs_(island.scene, island.geometry, island.ids, states, effects.counters),
      since_s_(states.size(), 0.0),
      errors_(states.size(), 0.0),
      taken_(states.size(), 0),
      in_impact_(states.size(), 0) {
  for (const ContactManifold& m : island.manifolds) {
    const bool fixed = is_static(m.b);
    const std::uint32_t pair =
        pairs_.add({place_of(island.ids, m.a),
                    fixed ? static_index_of(m.b) : place_of(island.ids, m.b), fixed});
    looks_.resize(pairs_.size());
    looks_[pair].found.push_back(m);
  }
  looks_.resize(pairs_.size());
  for (std::uint32_t pair = 0; pair < looks_.size(); ++pair) {
    Look& look = looks_[pair];
    look.time_s = 0.0;
    look.held = is_held(look, 0.0);
    const double clear = clear_s(island_, look.found, states);
    look.comes = clear < island_.dt_s;
    expect(pair, std::min(clear, foreseen_s(island_, look.found, states)));
  }
}

void ContactImpactRun::expect(std::uint32_t pair, double ahead_s) {
  const MeetingPair& p = pairs_[pair];
  const double now = since_s_[p.a];
  const double time = std::max(now + ahead_s, ahead_s > 0.0 ? std::nextafter(now, kNever) : now);
  next_.set(pairs_, pair, time < island_.dt_s ? time : kNever);
}

bool ContactImpactRun::is_held(const Look& look, double now_s) const {
  for (const ContactManifold& contact : look.found) {
    const ContactManifold m = without_impacts(island_, contact, states());
    if (m.count == 0) continue;
    if (!apart_ || is_static(m.b) || island_.scene.tolerance > 0.0) return true;
    if (holds(island_.scene, island_.geometry, island_.dt_s - now_s, m,
              island_.state_of(m.a, states()), island_.state_of(m.b, states())))
      return true;
  }
  return false;
}

// Of advancing it once.
std::size_t ContactImpactRun::work_of(const Bodies& set) const {
  std::size_t work = set.size();
  for (const std::uint32_t body : set)
    for (const std::uint32_t pair : pairs_.of(body))
      if (pairs_[pair].a == body && looks_[pair].held)
        for (const ContactManifold& m : looks_[pair].found) work += m.count;
  return set.size() > 1 ? kIterated * work : work;
}

bool ContactImpactRun::is_affordable() {
  std::vector<std::size_t> works(states_.size(), 0);
  const auto work_at = [&](std::uint32_t body) {
    if (works[body] == 0) {
      const Bodies set = set_of(body, false);
      const std::size_t of_set = work_of(set);
      for (const std::uint32_t one : set) works[one] = of_set;
    }
    return works[body];
  };
  std::size_t work = 0;
  for (std::uint32_t pair = 0; pair < pairs_.size(); ++pair) {
    if (!looks_[pair].comes) continue;
    work += work_at(pairs_[pair].a);
    if (!pairs_[pair].fixed) work += work_at(pairs_[pair].b);
  }
  return work <= most_ahead(states_.size());
}

bool ContactImpactRun::stayed_apart() const {
  constexpr double kStayed = 1e-8;  // of the width
  const auto nearest_m = [](std::span<const ContactManifold> contacts) {
    double nearest = 0.0;
    for (const ContactManifold& m : contacts) nearest = std::min(nearest, least_separation_m(m));
    return nearest;
  };
  std::vector<ContactManifold> now;
  for (std::uint32_t pair = 0; pair < pairs_.size(); ++pair) {
    const MeetingPair& p = pairs_[pair];
    const Look& look = looks_[pair];
    if (p.fixed || look.held || look.found.empty()) continue;
    now.clear();
    collide({island_.scene, island_.geometry, 0.0, island_.ids[p.a], states_[p.a], other(p),
             &states_[p.b]},
            now, effects_.counters);
    if (nearest_m(now) < nearest_m(look.found) - kStayed * island_.width_m(look.found.front()))
      return false;
  }
  return true;
}

// Both are there now.
void ContactImpactRun::look(std::uint32_t pair, double now_s) {
  const MeetingPair& p = pairs_[pair];
  looks_.resize(std::max(looks_.size(), pairs_.size()));
  Look& look = looks_[pair];
  look.found.clear();
  look.time_s = now_s;
  if (pairs_.are_near(pair)) {
    collide({island_.scene, island_.geometry, island_.dt_s - now_s, island_.ids[p.a], states_[p.a],
             other(p), p.fixed ? nullptr : &states_[p.b]},
            look.found, effects_.counters);
    ++effects_.counters.hit_searches;
  }
  look.held = is_held(look, now_s);
  if (look.found.empty())
    next_.set(pairs_, pair, kNever);
  else
    expect(pair, std::min(clear_s(island_, look.found, states()),
                          foreseen_s(island_, look.found, states())));
}

// `all`: what is near does, too. What was found of a pair can be from before a hit that has sent
// one of them elsewhere, and is no part of any set then.
bool ContactImpactRun::makes_a_set(std::uint32_t pair, bool all) const {
  return looks_[pair].held || (all && pairs_.are_near(pair));
}

// The bodies that such pairs lead to from this one, ascending.
ContactImpactRun::Bodies ContactImpactRun::set_of(std::uint32_t body, bool all) {
  Bodies set{body};
  taken_[body] = 1;
  for (std::size_t i = 0; i < set.size(); ++i) {
    for (const std::uint32_t pair : pairs_.of(set[i])) {
      const MeetingPair& p = pairs_[pair];
      if (p.fixed) break;
      const std::uint32_t next = p.other(set[i]);
      if (taken_[next] || !makes_a_set(pair, all)) continue;
      taken_[next] = 1;
      set.push_back(next);
    }
  }
  for (const std::uint32_t one : set) taken_[one] = 0;
  std::sort(set.begin(), set.end());
  return set;
}

// `all`: with the points that hit, and links where hits can send one to the other.
void ContactImpactRun::advance_set(const Bodies& set, double to_s, bool all) {
  const SceneDescription& scene = island_.scene;
  const double from_s = since_s_[set.front()], time_s = to_s - from_s;
  std::vector<ContactManifold> contacts;
  for (const std::uint32_t body : set) {
    for (const std::uint32_t pair : pairs_.of(body)) {
      if (pairs_[pair].a != body) continue;
      if (!pairs_[pair].fixed && !makes_a_set(pair, all)) continue;
      const std::vector<ContactManifold>& found = looks_[pair].found;
      if (!all)
        append_held(island_, found, states_, contacts);
      else if (!found.empty())
        contacts.insert(contacts.end(), found.begin(), found.end());
      else if (!pairs_[pair].fixed)
        contacts.push_back(link_of(pair));
    }
  }
  std::vector<BodyId> ids;
  std::vector<BodyState> now;
  for (const std::uint32_t body : set) {
    ids.push_back(island_.ids[body]);
    now.push_back(states_[body]);
  }
  report_.static_impulse_newton_s += push_impulses_newton_s(scene, time_s, ids, now);
  if (contacts.empty()) {
    for (std::size_t i = 0; i < ids.size(); ++i)
      advance_free_body(scene, time_s, ids[i], now[i], effects_.counters, effects_.faults);
  } else {
    IslandReport part =
        advance_resting({scene, island_.geometry, time_s, ids, contacts}, now, effects_);
    for (const std::uint32_t body : set) errors_[body] += part.error_estimate;
    part.error_estimate = 0.0;
    add_part(part, report_);
  }
  for (std::size_t i = 0; i < set.size(); ++i) {
    std::swap(states_[set[i]], now[i]);
    since_s_[set[i]] = to_s;
  }
  if (to_s < island_.dt_s) look_after(set, now, from_s, to_s);
}

// Pairs within the set are looked at again; and those with others that a body comes to because
// something has changed its velocity as only hits do.
void ContactImpactRun::look_after(const Bodies& set, std::span<const BodyState> before,
                                  double from_s, double now_s) {
  const double pulled_m_s = 2.0 * island_.strongest_field_m_s2() * (now_s - from_s);
  for (std::size_t i = 0; i < set.size(); ++i) {
    const BodyId id = island_.ids[set[i]];
    const BodyState& now = states_[set[i]];
    const double radius_m = shape_of(island_.scene, island_.geometry, id).bounding_radius_m;
    const double most_m_s =
        pulled_m_s + 2.0 * pushed_m_s2(island_, id, before[i]) * (now_s - from_s);
    const double change_m_s =
        (now.linear_velocity_m_s - before[i].linear_velocity_m_s).norm() +
        radius_m * (now.angular_velocity_rad_s - before[i].angular_velocity_rad_s).norm();
    if (change_m_s > most_m_s) redirect(set[i], now_s);
  }
  for (const std::uint32_t body : set)
    for (const std::uint32_t pair : pairs_.of(body))
      if (is_at(pairs_[pair], now_s) && looks_[pair].time_s != now_s) look(pair, now_s);
}

void ContactImpactRun::bring(std::uint32_t body, double to_s) {
  if (since_s_[body] < to_s) advance_set(set_of(body, false), to_s, false);
}

// The body is on another path now: all that it can meet is to be looked at.
void ContactImpactRun::redirect(std::uint32_t body, double now_s) {
  pairs_.redirect(body, states_[body], (island_.dt_s - now_s) / island_.scene.dt_s,
                  effects_.counters);
  looks_.resize(std::max(looks_.size(), pairs_.size()));
  for (const std::uint32_t pair : pairs_.of(body)) {
    if (is_at(pairs_[pair], now_s))
      looks_[pair].time_s = -1.0;
    else
      next_.set(pairs_, pair, pairs_.are_near(pair) ? now_s : kNever);
  }
}

// The bodies that something touches, and holds, from this pair on; ascending.
ContactImpactRun::Bodies ContactImpactRun::bodies_of_impact(
    std::uint32_t pair, double now_s, std::vector<ContactManifold>& touching) {
  Bodies hit{pairs_[pair].a};
  taken_pairs_.assign(pairs_.size(), 0);
  in_impact_[hit.front()] = 1;
  for (std::size_t i = 0; i < hit.size(); ++i) {
    const std::uint32_t body = hit[i];
    const std::vector<std::uint32_t> of(pairs_.of(body).begin(), pairs_.of(body).end());
    for (const std::uint32_t q : of) {
      const MeetingPair p = pairs_[q];
      taken_pairs_.resize(pairs_.size(), 0);
      if (taken_pairs_[q]) continue;
      if (!is_at(p, now_s)) {
        if (next_.time_s(q) == kNever && looks_[q].found.empty()) continue;
        bring(p.other(body), now_s);
      }
      if (looks_[q].time_s != now_s) look(q, now_s);
      if (!append_touching(island_, looks_[q].found, states(), touching)) continue;
      taken_pairs_[q] = 1;
      if (p.fixed || in_impact_[p.other(body)]) continue;
      in_impact_[p.other(body)] = 1;
      hit.push_back(p.other(body));
    }
  }
  for (const std::uint32_t body : hit) in_impact_[body] = 0;
  std::sort(hit.begin(), hit.end());
  std::sort(touching.begin(), touching.end(), canonical_before);
  return hit;
}

bool ContactImpactRun::resolve_impact_at(std::uint32_t pair, double now_s) {
  std::vector<ContactManifold> touching;
  const Bodies hit = bodies_of_impact(pair, now_s, touching);
  std::vector<BodyId> ids;
  std::vector<BodyState> after;
  for (const std::uint32_t body : hit) {
    ids.push_back(island_.ids[body]);
    after.push_back(states_[body]);
  }
  if (!resolve_impact(island_.scene, ids, touching, after, report_, effects_.counters))
    return false;
  Bodies changed;
  for (std::size_t i = 0; i < hit.size(); ++i) {
    const BodyState& before = states_[hit[i]];
    if (before.linear_velocity_m_s != after[i].linear_velocity_m_s ||
        before.angular_velocity_rad_s != after[i].angular_velocity_rad_s)
      changed.push_back(hit[i]);
    states_[hit[i]] = std::move(after[i]);
  }
  for (const std::uint32_t body : changed) redirect(body, now_s);
  for (const std::uint32_t body : changed)
    for (const std::uint32_t q : pairs_.of(body))
      if (is_at(pairs_[q], now_s) && looks_[q].time_s != now_s) look(q, now_s);
  return true;
}

// What is left of the step at this time is one step, with all that comes near in it: there is no
// work left for hits.
void ContactImpactRun::finish(double now_s) {
  for (std::uint32_t body = 0; body < since_s_.size(); ++body) bring(body, now_s);
  for (std::uint32_t pair = 0; pair < pairs_.size(); ++pair)
    if (pairs_.are_near(pair) && looks_[pair].time_s != now_s) look(pair, now_s);
  for (std::uint32_t body = 0; body < since_s_.size(); ++body)
    if (since_s_[body] < island_.dt_s) advance_set(set_of(body, true), island_.dt_s, true);
  report_.beyond_tolerance = island_.scene.tolerance > 0.0;
}

double ContactImpactRun::work() const {
  const StageCounters& now = effects_.counters;
  return static_cast<double>(now.row_sweeps) +
         static_cast<double>(now.factor_multiplications) / kMultiplicationsOfRow +
         kRowsOfLook * static_cast<double>(now.hit_searches + events_);
}

bool ContactImpactRun::run() {
  const double most = work() + most_work(states_.size());
  const bool any = next_.first_s() < island_.dt_s;
  bool enough = true;
  while (enough && next_.first_s() < island_.dt_s) {
    const double now = next_.first_s();
    const std::uint32_t pair = next_.take_first();
    const MeetingPair p = pairs_[pair];
    bring(p.a, now);
    if (!p.fixed) bring(p.b, now);
    if (looks_[pair].time_s != now) look(pair, now);
    ++events_;
    const bool is_hit = clear_s(island_, looks_[pair].found, states()) == 0.0;
    const bool resolved = !is_hit || resolve_impact_at(pair, now), affordable = work() < most;
    enough = resolved && affordable;
    effects_.counters.islands_over_budget += !affordable;
    if (!enough) finish(now);
  }
  for (std::uint32_t body = 0; body < since_s_.size(); ++body) bring(body, island_.dt_s);
  const auto worst = std::max_element(errors_.begin(), errors_.end());
  report_.error_estimate = *worst;
  report_.worst_body = island_.ids[static_cast<std::size_t>(worst - errors_.begin())];
  return any;
}

}  // namespace soda::physics
