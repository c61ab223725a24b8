#include "soda/simulation.hpp"

#include <algorithm>
#include <utility>

#include "library/src/moment.hpp"
#include "library/src/scene_impl.hpp"
#include "library/src/simulation_impl.hpp"
#include "physics/measures/measures.hpp"

namespace soda {
namespace {

using models::InputKind;

Moment beginning(const scenarios::Scenario& scenario) {
  Moment moment;
  const models::Presence presence(scenario.run.inputs.absent);
  for (std::uint32_t i = 0; i < scenario.initial.size(); ++i) {
    if (!presence.has(physics::BodyId{i})) continue;
    moment.ids.push_back(physics::BodyId{i});
    moment.states.push_back(scenario.initial[i]);
  }
  return moment;
}

std::vector<models::UserInput> in_order(std::vector<models::UserInput> inputs) {
  std::sort(inputs.begin(), inputs.end(), models::acts_before);
  return inputs;
}

}  // namespace

Simulation::Impl::Impl(const Scene& of)
    : scene(of),
      base(*of.impl()),
      script(in_order(base.scenario.run.inputs.script)),
      now(beginning(base.scenario)) {
  renew();
}

// After whatever may have changed who is there, or what bodies are made of.
void Simulation::Impl::renew() {
  const auto version = base.versions.with(now.changes);
  if (version != description) {
    stepper.forget();
    description = version;
  }
  labels.clear();
  for (const physics::BodyId id : now.ids)
    labels.push_back(description->bodies[physics::index_of(id)].label);
}

std::size_t Simulation::Impl::place_of(std::uint32_t body) const {
  const auto place = std::ranges::lower_bound(labels, body);
  if (place != labels.end() && *place == body)
    return static_cast<std::size_t>(place - labels.begin());
  body_with(base.scenario.scene, body);
  throw UsageError("body " + std::to_string(body) + " is not there after " +
                   std::to_string(now.step) + " steps");
}

// As a world does it (models/world/arrivals.cpp).
void Simulation::Impl::act(const models::UserInput& input) {
  if (!models::note_change(input, base.scenario.scene, now.changes))
    models::act_on_bodies(input, base.scenario.scene, now.ids, now.states);
}

void Simulation::Impl::take_inputs() {
  auto own = std::ranges::lower_bound(script, now.step, {}, &models::UserInput::step);
  const auto given_end =
      std::ranges::upper_bound(now.given, now.step, {}, &models::UserInput::step);
  auto given = now.given.begin();
  const auto is_due = [this, &own] { return own != script.end() && own->step == now.step; };
  if (!is_due() && given == given_end) return;
  while (is_due() || given != given_end) {
    const bool takes_own = is_due() && (given == given_end || own->id < given->id);
    act(takes_own ? *own++ : *given++);
  }
  now.given.erase(now.given.begin(), given_end);
  renew();
}

void Simulation::Impl::advance() {
  if (failure) throw *failure;
  take_inputs();
  stepper.step(*description, base.geometry, now.ids, now.states);
  if (!stepper.faults().empty()) {
    const auto& least =
        *std::ranges::min_element(stepper.faults(), {}, &physics::AdvanceFault::body);
    failure.emplace(now.step, description->bodies[physics::index_of(least.body)].label, least.what);
    throw *failure;
  }
  ++now.step;
  ++made;
}

void Simulation::Impl::add(models::UserInput input) {
  if (input.step < 0) input.step = now.step;
  const std::string name = "input " + std::to_string(input.id);
  if (input.step < now.step)
    throw UsageError(name + " is for step " + std::to_string(input.step) + "; " +
                     std::to_string(now.step) + " steps have been made");
  const auto is_same = [&input](const models::UserInput& other) {
    return other.step == input.step && other.id == input.id;
  };
  const auto own = std::ranges::equal_range(script, input.step, {}, &models::UserInput::step);
  if (std::ranges::any_of(own, is_same) || std::ranges::any_of(now.given, is_same))
    throw UsageError(name + " again at step " + std::to_string(input.step) +
                     "; allowed: an id that no other input of the step has");
  now.given.insert(std::ranges::upper_bound(now.given, input, models::acts_before), input);
}

Simulation::Simulation(const Scene& scene) : impl_(std::make_unique<Impl>(scene)) {}
Simulation::~Simulation() = default;
Simulation::Simulation(Simulation&&) noexcept = default;
Simulation& Simulation::operator=(Simulation&&) noexcept = default;

const Scene& Simulation::scene() const { return impl_->scene; }

void Simulation::step(std::int64_t steps) {
  if (steps < 0)
    throw UsageError("step: found " + std::to_string(steps) + " steps; allowed: at least 0");
  for (; steps > 0; --steps) {
    impl_->advance();
    if (impl_->callback) impl_->callback(*this);
  }
}

std::int64_t Simulation::steps() const { return impl_->now.step; }
double Simulation::time_s() const {
  return static_cast<double>(impl_->now.step) * impl_->description->dt_s;
}
std::uint64_t Simulation::digest() const {
  return physics::digest(impl_->now.ids, impl_->now.states);
}
void Simulation::on_step(std::function<void(const Simulation&)> callback) {
  impl_->callback = std::move(callback);
}

StepReport Simulation::report() const {
  StepReport report;
  for (const physics::IslandReport& island : impl_->stepper.islands()) {
    ++report.islands;
    report.contact_points += island.contact_points;
    report.deepest_penetration_m = std::max(report.deepest_penetration_m, island.max_penetration_m);
    report.constraint_residual_m_s =
        std::max(report.constraint_residual_m_s, island.constraint_residual_m_s);
  }
  return report;
}

Counters Simulation::counters() const {
  const physics::StageCounters& of = impl_->stepper.counters();
  return {.steps = impl_->made,
          .candidate_pairs = of.candidate_pairs,
          .contact_points = of.contact_points,
          .islands_solved = of.islands_solved,
          .islands_at_rest = of.islands_at_rest,
          .solver_iterations = of.solver_iterations,
          .impacts = of.impacts,
          .joints_broken = of.joints_broken};
}

void Simulation::apply(const Input& input) {
  const scenarios::Scenario& scenario = impl_->base.scenario;
  impl_->add(read_input(scenario, input_line(scenario, input)));
}

void Simulation::apply(std::string_view line) {
  impl_->add(read_input(impl_->base.scenario, line));
}

Snapshot Simulation::snapshot() const {
  Snapshot made;
  snapshot(made);
  return made;
}

void Simulation::snapshot(Snapshot& into) const {
  encode(impl_->now, impl_->base.fingerprint, into.bytes);
}

void Simulation::restore(const Snapshot& snapshot) {
  decode(snapshot.bytes, impl_->base.scenario.scene, impl_->base.fingerprint, impl_->spare);
  std::swap(impl_->now, impl_->spare);
  impl_->failure.reset();
  impl_->renew();
}

}  // namespace soda
