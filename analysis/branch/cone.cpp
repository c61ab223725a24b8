#include "analysis/branch/cone.hpp"

#include <algorithm>
#include <utility>

#include "analysis/text/exit_codes.hpp"
#include "physics/measures/measures.hpp"

namespace soda::analysis {
namespace {

using physics::Aabb;
using physics::BodyId;
using physics::BodyState;
using physics::Vec3;

// A body of the cone is read, compared and advanced: that takes about four times as long as it
// takes to advance it among all. To look through the bounds of so many bodies is as much.
constexpr std::uint64_t kDearer = 4, kBoundsABody = 64, kAlways = 2000;

bool is_same(const std::optional<BodyState>& a, const std::optional<BodyState>& b) {
  return a.has_value() == b.has_value() && (!a || physics::identical(*a, *b));
}

Aabb widened(const Aabb& box, double by_m) {
  return {box.min - Vec3::Constant(by_m), box.max + Vec3::Constant(by_m)};
}

bool holds(const Aabb& box, const Aabb& other) {
  return (box.min.array() <= other.min.array()).all() &&
         (other.max.array() <= box.max.array()).all();
}

}  // namespace

Cone::Cone(LogReader& log, const scenarios::Scenario& scenario)
    : log_(log),
      scene_(scenario.scene),
      geometry_(scene_),
      recorded_(log, scene_, geometry_),
      presence_(scenario.run.inputs.absent),
      script_(scenario.run.inputs.script),
      step_(scenario.run.first_step),
      most_work_(kAlways + scene_.bodies.size() *
                               static_cast<std::uint64_t>(scenario.run.steps - step_) / kDearer) {
  std::ranges::sort(script_, models::acts_before);
}

bool Cone::advance() {
  const StepHead head = log_.read_head(step_ + 1);
  if (!recorded_.begin(step_, head.inputs)) return false;
  if (near_until_ != recorded_.bounded_to()) near_.clear();
  near_until_ = recorded_.bounded_to();
  take_inputs(head.inputs);
  members_.clear();
  for (const auto& [id, state] : differing_) add_member(id);
  do {
    gather();
    if (work_ > most_work_) return false;
    run();
  } while (reaches_others());
  keep_what_differs();
  body_steps_ += members_.size();
  ++step_;
  return true;
}

// What the recorded run does not have makes a difference.
void Cone::take_inputs(std::span<const models::CommittedInput> recorded) {
  acting_.clear();
  bool any_change = false;
  for (; next_input_ < script_.size() && script_[next_input_].step <= step_; ++next_input_) {
    const models::UserInput& input = script_[next_input_];
    const bool is_new = std::ranges::none_of(
        recorded, [&](const models::CommittedInput& r) { return r.input.id == input.id; });
    if (is_new) note_new(input);
    if (!presence_.note(input)) continue;
    if (changes_scene(input.kind)) {
      std::vector<BodyId> none;
      std::vector<BodyState> no_states;
      models::act_on_scene(input, scene_, none, no_states);
      any_change = true;
    } else {
      acting_.push_back(input);
    }
  }
  if (any_change) stepper_.forget();
}

void Cone::note_new(const models::UserInput& input) {
  if (changes_scene(input.kind)) changed_.insert(input.body);
  if (!differing_.contains(input.body))
    differing_.emplace(input.body, recorded_.before(input.body));
}

void Cone::add_member(BodyId id) {
  Member& member = members_[id];
  ++work_;
  const auto differing = differing_.find(id);
  if (differing == differing_.end()) {
    member.start = recorded_.body(id).start;
    return;
  }
  std::vector<BodyId> ids;
  std::vector<BodyState> states;
  if (differing->second) {
    ids.push_back(id);
    states.push_back(*differing->second);
  }
  for (const models::UserInput& input : acting_)
    if (input.body == id) models::act_on_bodies(input, scene_, ids, states);
  if (!states.empty()) member.start = std::move(states.front());
}

// Whoever may touch a member, in the recorded step or in the new one, becomes one.
void Cone::gather() {
  double fastest_m_s = recorded_.most_speed_m_s();
  for (const auto& [id, member] : members_)
    if (member.start) fastest_m_s = std::max(fastest_m_s, member.start->linear_velocity_m_s.norm());
  const double reach_m =
      (2.0 * fastest_m_s + scene_.gravity_m_s2.norm() * scene_.dt_s) * scene_.dt_s;
  slack_m_ = 2.0 * reach_m;  // of both
  bool any = true;
  while (any) {
    any = false;
    for (auto& [id, member] : members_) {
      if (std::exchange(member.is_looked_at, true)) continue;
      const RecordedBody& recorded = recorded_.body(id);
      if (recorded.start) any = add_those_near(id, recorded.box) || any;
      if (member.start && differing_.contains(id))
        any = add_those_near(id, box_of_step(scene_, geometry_, id, *member.start, nullptr)) || any;
    }
  }
}

// Of the bodies that are as recorded. Whether there are any new ones.
bool Cone::add_those_near(BodyId id, Aabb box) {
  box = widened(box, slack_m_);
  bool any = false;
  const auto consider = [&](BodyId other) {
    if (members_.contains(other)) return;
    const RecordedBody& recorded = recorded_.body(other);
    if (!recorded.start || !physics::overlap(box, recorded.box)) return;
    add_member(other);
    any = true;
  };
  for (const BodyId other : near(id, box)) consider(other);
  for (const models::UserInput& input : acting_) consider(input.body);
  return any;
}

// With room for the way of some steps, so that it holds for them.
const std::vector<BodyId>& Cone::near(BodyId id, const Aabb& box) {
  Near& known = near_[id];
  if (!known.bodies.empty() && holds(known.box, box)) return known.bodies;
  known.box = widened(box, 4.0 * slack_m_);
  recorded_.find_near(known.box, known.bodies);
  work_ += scene_.bodies.size() / kBoundsABody;
  return known.bodies;
}

void Cone::run() {
  std::vector<BodyId> ids;
  std::vector<BodyState> states;
  for (const auto& [id, member] : members_) {
    if (!member.start) continue;
    ids.push_back(id);
    states.push_back(*member.start);
  }
  if (ids.empty()) return;
  stepper_.step(scene_, geometry_, ids, states);
  const std::vector<physics::AdvanceFault>& faults = stepper_.faults();
  if (!faults.empty()) {
    const auto& fault = *std::ranges::min_element(faults, {}, &physics::AdvanceFault::body);
    throw NumericalFailure("step " + std::to_string(step_) + ", world 0, body " +
                           std::to_string(log_.labels()[physics::index_of(fault.body)]) + ": " +
                           fault.what);
  }
  for (std::size_t i = 0; i < ids.size(); ++i) members_[ids[i]].end = std::move(states[i]);
}

// Hits may have sent a member where it comes to somebody that was not foreseen.
bool Cone::reaches_others() {
  bool any = false;
  std::vector<BodyId> ids;
  for (const auto& [id, member] : members_) ids.push_back(id);
  for (const BodyId id : ids) {
    const Member& member = members_[id];
    if (member.start)
      any = add_those_near(id, box_of_step(scene_, geometry_, id, *member.start, &*member.end)) ||
            any;
  }
  return any;
}

void Cone::keep_what_differs() {
  differing_.clear();
  for (auto& [id, member] : members_)
    if (changed_.contains(id) || !is_same(member.end, recorded_.body(id).end))
      differing_.emplace(id, std::move(member.end));
}

StepDifference Cone::difference() {
  LoggedStep recorded;
  recorded.step = step_;
  std::vector<BodyId> ids;
  std::vector<BodyState> states;
  for (const auto& [id, state] : differing_) {
    // The step that has just been made ends where the next one begins.
    if (const State& was = recorded_.body(id).end) {
      recorded.ids.push_back(id);
      recorded.states.push_back(*was);
    }
    if (state) {
      ids.push_back(id);
      states.push_back(*state);
    }
  }
  return difference_.add(recorded, ids, states);
}

std::uint64_t Cone::digest() {
  LoggedStates now;
  if (step_ == log_.last_step()) {
    now = log_.read_last_states();
  } else {
    LoggedStep logged = log_.read_states(step_);
    now = {std::move(logged.ids), std::move(logged.states)};
  }
  for (const auto& [id, state] : differing_) {
    const auto at = std::ranges::lower_bound(now.ids, id);
    const auto place = at - now.ids.begin();
    const bool is_there = at != now.ids.end() && *at == id;
    if (is_there && state) {
      now.states[static_cast<std::size_t>(place)] = *state;
    } else if (is_there) {
      now.ids.erase(at);
      now.states.erase(now.states.begin() + place);
    } else if (state) {
      now.ids.insert(at, id);
      now.states.insert(now.states.begin() + place, *state);
    }
  }
  return physics::digest(now.ids, now.states);
}

}  // namespace soda::analysis
