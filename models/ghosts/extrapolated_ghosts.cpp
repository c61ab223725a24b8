#include "models/ghosts/extrapolated_ghosts.hpp"

#include <algorithm>
#include <tuple>

#include "physics/integrators/advance_once.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/model/island_report.hpp"
#include "physics/step/step.hpp"

namespace soda::models {
namespace {

using physics::BodyId;
using physics::BodyState;

bool has(std::span<const WorldId> worlds, WorldId world) {
  return std::binary_search(worlds.begin(), worlds.end(), world);
}

void go_on(const physics::SceneDescription& scene, BodyState& state) {
  BodyState next = state;
  next.position_m += state.linear_velocity_m_s * scene.dt_s;
  next.orientation = physics::turned(state.angular_velocity_rad_s * scene.dt_s, state.orientation);
  if (*physics::fault_of(next) == '\0') state = std::move(next);
}

// Faults are the owner's business.
void guess_next(GhostMode mode, const physics::SceneDescription& scene, BodyId id, BodyState& state,
                physics::StageCounters& counters) {
  std::vector<physics::AdvanceFault> faults;
  if (mode == GhostMode::kPredicted && state.impulses.empty())
    physics::advance_free_body(scene, scene.dt_s, id, state, counters, faults);
  else
    go_on(scene, state);
}

// Where foreign bodies are at the start of this step, whoever owns them now; ascending by id.
std::vector<Node> foreign_bodies_now(GhostMode mode, const Rules& rules, const ForeignView& before,
                                     physics::StageCounters& counters) {
  std::vector<Node> bodies = before.known;
  const std::size_t known = bodies.size();
  const auto by_id = [](const Node& a, const Node& b) { return a.id < b.id; };
  std::sort(bodies.begin(), bodies.end(), by_id);
  for (const Ghost& ghost : before.received.ghosts) {
    const auto end = bodies.begin() + static_cast<std::ptrdiff_t>(known);
    if (std::binary_search(bodies.begin(), end, Node{ghost.id, {}, {}}, by_id)) continue;
    bodies.push_back({ghost.id, ghost.owner, ghost.state});
    guess_next(mode, *rules.scene, ghost.id, bodies.back().state, counters);
  }
  // While a migration is being rolled back a body can have been sent by two worlds.
  std::stable_sort(bodies.begin(), bodies.end(), by_id);
  bodies.erase(std::unique(bodies.begin(), bodies.end(),
                           [](const Node& a, const Node& b) { return a.id == b.id; }),
               bodies.end());
  return bodies;
}

}  // namespace

std::vector<BodyId> differing(std::span<const Ghost> a, std::span<const Ghost> b) {
  std::vector<BodyId> bodies;
  const auto before = [](const Ghost& x, const Ghost& y) {
    return std::tie(x.owner, x.id) < std::tie(y.owner, y.id);
  };
  auto other = b.begin();
  for (const Ghost& ghost : a) {
    for (; other != b.end() && before(*other, ghost); ++other) bodies.push_back(other->id);
    const bool is_there = other != b.end() && !before(ghost, *other);
    if (!is_there || !identical(ghost, *other)) bodies.push_back(ghost.id);
    if (is_there) ++other;
  }
  for (; other != b.end(); ++other) bodies.push_back(other->id);
  std::sort(bodies.begin(), bodies.end());
  bodies.erase(std::unique(bodies.begin(), bodies.end()), bodies.end());
  return bodies;
}

bool operator==(const ForeignView& a, const ForeignView& b) {
  const auto same_node = [](const Node& x, const Node& y) {
    return x.id == y.id && x.owner == y.owner && physics::identical(x.state, y.state);
  };
  return a.ghosts_sent_to == b.ghosts_sent_to && a.bodies_sent_to == b.bodies_sent_to &&
         differing(a.received.ghosts, b.received.ghosts).empty() &&
         std::equal(a.known.begin(), a.known.end(), b.known.begin(), b.known.end(), same_node);
}

void add_world(WorldId world, std::vector<WorldId>& worlds) {
  const auto place = std::lower_bound(worlds.begin(), worlds.end(), world);
  if (place == worlds.end() || *place != world) worlds.insert(place, world);
}

std::vector<WorldId> news_from(const ForeignView& view) {
  std::vector<WorldId> worlds = view.bodies_sent_to;
  for (const Ghost& ghost : view.received.ghosts) add_world(ghost.owner, worlds);
  return worlds;
}

std::vector<Ghost> foreign_ghosts(std::vector<Ghost> ghosts,
                                  const std::function<bool(BodyId)>& is_own) {
  std::stable_sort(ghosts.begin(), ghosts.end(),
                   [](const Ghost& a, const Ghost& b) { return a.id < b.id; });
  const auto repeated = std::unique(ghosts.begin(), ghosts.end(),
                                    [](const Ghost& a, const Ghost& b) { return a.id == b.id; });
  ghosts.erase(repeated, ghosts.end());
  std::erase_if(ghosts, [&is_own](const Ghost& ghost) { return is_own(ghost.id); });
  return ghosts;
}

std::vector<Ghost> extrapolate_ghosts(GhostMode mode, const Rules& rules,
                                      const physics::Geometry& geometry, const ToldWorld& told,
                                      const ForeignView& before, physics::StageCounters& counters) {
  const auto& [self, received] = told;
  std::vector<Ghost> extrapolated;
  const std::vector<WorldId> speakers = news_from(before);
  if (std::includes(received.begin(), received.end(), speakers.begin(), speakers.end()))
    return extrapolated;
  std::vector<BodyId> ids;
  std::vector<BodyState> states;
  std::vector<WorldId> owners;
  for (Node& body : foreign_bodies_now(mode, rules, before, counters)) {
    const WorldId owner = rules.map->owner_at(body.state.position_m);
    if (owner == self || has(received, owner) || !has(speakers, owner)) continue;
    ids.push_back(body.id);
    states.push_back(std::move(body.state));
    owners.push_back(owner);
  }
  std::vector<physics::Aabb> boxes;
  physics::compute_boxes(*rules.scene, geometry, ids, states, boxes, counters);
  std::vector<WorldId> covered;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    rules.map->owners_of(boxes[i], covered);
    if (has(covered, self))
      extrapolated.push_back({ids[i], owners[i], boxes[i], std::move(states[i])});
  }
  std::sort(extrapolated.begin(), extrapolated.end(), [](const Ghost& a, const Ghost& b) {
    return std::tie(a.owner, a.id) < std::tie(b.owner, b.id);
  });
  return extrapolated;
}

}  // namespace soda::models
