#include "soda/scene.hpp"

#include <bit>
#include <utility>

#include "kernel/api/hash_mix.hpp"
#include "library/src/scene_impl.hpp"
#include "physics/measures/measures.hpp"
#include "scenarios/cross_checks.hpp"

namespace soda {
namespace {

std::uint64_t fingerprint_of(const scenarios::Scenario& scenario) {
  const physics::SceneDescription& scene = scenario.scene;
  std::vector<physics::BodyId> ids;
  for (std::uint32_t i = 0; i < scenario.initial.size(); ++i) ids.push_back(physics::BodyId{i});
  std::uint64_t print = physics::digest(ids, scenario.initial);
  const auto add = [&print](double value) {
    print = kernel::append(print, std::bit_cast<std::uint64_t>(value));
  };
  for (const double value : {scene.dt_s, scene.tolerance, scene.gravity_m_s2.x(),
                             scene.gravity_m_s2.y(), scene.gravity_m_s2.z()})
    add(value);
  for (const std::size_t count : {scene.shapes.size(), scene.statics.size(), scene.joints.size(),
                                  static_cast<std::size_t>(scene.solver.iterations)})
    print = kernel::append(print, count);
  for (const physics::BodyParams& body : scene.bodies) {
    print = kernel::append(print, body.label);
    for (const double value : {body.mass_kg, body.material.friction, body.material.restitution})
      add(value);
  }
  for (const physics::StaticBody& body : scene.statics)
    for (int i = 0; i < 3; ++i) add(body.position_m[i]);
  return print;
}

std::string text_of(const scenarios::InputWarning& warning) {
  return warning.pointer + ": " + warning.kind + ": found " + warning.found +
         "; likely: " + warning.likely;
}

std::shared_ptr<const Scene::Impl> make(scenarios::Scenario scenario) {
  return std::make_shared<const Scene::Impl>(std::move(scenario));
}

}  // namespace

Scene::Impl::Impl(scenarios::Scenario read)
    : scenario(std::move(read)),
      geometry(scenario.scene),
      fingerprint(fingerprint_of(scenario)),
      versions(scenario.scene) {}

Scene::Scene(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}

Scene Scene::load(const std::string& file, std::optional<std::uint64_t> seed) {
  return translated([&] { return Scene(make(scenarios::read_scenario_file(file, seed))); });
}

Scene Scene::parse(std::string_view text, const std::string& name,
                   std::optional<std::uint64_t> seed) {
  return translated([&] { return Scene(make(scenarios::read_scenario_text(text, name, seed))); });
}

Scene Scene::build(const SceneParts& parts) { return parse(scene_text(parts), parts.name); }

const std::string& Scene::name() const { return impl_->scenario.name; }
double Scene::time_step_s() const { return impl_->scenario.scene.dt_s; }
std::int64_t Scene::steps() const { return impl_->scenario.run.steps; }

std::vector<std::uint32_t> Scene::body_ids() const {
  std::vector<std::uint32_t> ids;
  for (const physics::BodyParams& body : impl_->scenario.scene.bodies) ids.push_back(body.label);
  return ids;
}

std::vector<std::string> Scene::static_names() const {
  std::vector<std::string> names;
  for (const physics::StaticBody& body : impl_->scenario.scene.statics) names.push_back(body.name);
  return names;
}

double Scene::mass_kg(std::uint32_t body) const {
  const physics::SceneDescription& scene = impl_->scenario.scene;
  return scene.bodies[physics::index_of(body_with(scene, body))].mass_kg;
}

std::vector<std::string> Scene::warnings() const {
  std::vector<std::string> texts;
  for (const scenarios::InputWarning& warning : impl_->scenario.warnings)
    texts.push_back(text_of(warning));
  return texts;
}

Solid outer(const physics::SceneDescription& scene, physics::BodyId id) {
  if (physics::is_static(id)) return {true, physics::static_index_of(id)};
  return {false, scene.bodies[physics::index_of(id)].label};
}

physics::BodyId body_with(const physics::SceneDescription& scene, std::uint32_t label) {
  if (const auto place = scenarios::find_body(scene, label)) return physics::BodyId{*place};
  throw UsageError("no body has the id " + std::to_string(label));
}

SceneError scene_error(const scenarios::InputError& error) {
  std::vector<SceneFault> faults;
  for (const scenarios::InputFault& f : error.faults())
    faults.push_back({f.line, f.column, f.pointer, f.found, f.allowed, f.hint});
  return SceneError(error.what(), std::move(faults));
}

}  // namespace soda
