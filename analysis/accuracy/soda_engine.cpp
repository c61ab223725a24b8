#include "analysis/accuracy/engine.hpp"
#include "analysis/measures/error_measures.hpp"
#include "physics/step/step.hpp"
#include "scenarios/quality.hpp"

namespace soda::analysis {
namespace {

// The plain loop over physics::step: the same bits as every division into worlds, and nothing of
// what dividing costs.
class SodaEngine final : public Engine {
 public:
  SodaEngine(const physics::SceneDescription& scene, std::span<const physics::BodyState> initial,
             const EngineSetting& setting)
      : scene_(with(scene, setting)),
        geometry_(scene_),
        ids_(all_ids(initial.size())),
        states_(initial.begin(), initial.end()) {
    if (scene_.tolerance > 0.0) estimates_ = ErrorEstimates{.tolerance = scene_.tolerance};
  }

  void step() override {
    physics::step(scene_, geometry_, ids_, states_, {scratch_, report_, counters_});
    ++steps_;
    if (estimates_) add_estimates(scene_, steps_, report_.islands, *estimates_);
    if (!report_.faults.empty() && fault_.empty()) {
      const physics::AdvanceFault& fault = report_.faults.front();
      fault_ = "body " + std::to_string(scene_.bodies[physics::index_of(fault.body)].label) + ": " +
               fault.what;
    }
  }
  void read(std::vector<physics::BodyState>& out) const override { out = states_; }
  void reverse() override {
    for (physics::BodyState& state : states_) {
      state.linear_velocity_m_s = -state.linear_velocity_m_s;
      state.angular_velocity_rad_s = -state.angular_velocity_rad_s;
    }
  }
  std::string fault() const override { return fault_; }
  std::optional<ErrorEstimates> estimates() const override { return estimates_; }

 private:
  static physics::SceneDescription with(physics::SceneDescription scene,
                                        const EngineSetting& setting) {
    scene.dt_s = setting.dt_s;
    if (setting.tolerance > 0.0) scene.tolerance = setting.tolerance;
    if (setting.iterations > 0) scene.solver.iterations = setting.iterations;
    return scene;
  }

  const physics::SceneDescription scene_;
  const physics::Geometry geometry_;
  const std::vector<physics::BodyId> ids_;
  std::vector<physics::BodyState> states_;
  physics::StepScratch scratch_;
  physics::StepReport report_;
  physics::StageCounters counters_;
  std::int64_t steps_ = 0;
  std::optional<ErrorEstimates> estimates_;
  std::string fault_;
};

template <void (*change)(physics::SceneDescription&)>
EngineKind kind(const char* name) {
  return {name, SODA_VERSION, [](const physics::SceneDescription&) { return std::string(); },
          [](const physics::SceneDescription& scene, std::span<const physics::BodyState> initial,
             const EngineSetting& setting) -> std::unique_ptr<Engine> {
            physics::SceneDescription changed = scene;
            change(changed);
            return std::make_unique<SodaEngine>(changed, initial, setting);
          }};
}

void change_nothing(physics::SceneDescription&) {}

template <scenarios::Quality quality>
void to(physics::SceneDescription& scene) {
  set_quality(quality, scene);
}

template <physics::Narrowphase narrowphase>
void to(physics::SceneDescription& scene) {
  scene.narrowphase = narrowphase;
}

}  // namespace

EngineKind soda_engine() { return kind<change_nothing>("soda"); }

std::vector<EngineKind> soda_engines() {
  return {soda_engine(), kind<to<scenarios::Quality::kFast>>("soda-fast"),
          kind<to<scenarios::Quality::kAccurate>>("soda-accurate"),
          kind<to<physics::Narrowphase::kFcl>>("soda-fcl"),
          kind<to<physics::Narrowphase::kOwn>>("soda-own")};
}

}  // namespace soda::analysis
