// Behind Simulation.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "library/src/moment.hpp"
#include "library/src/scene_impl.hpp"
#include "physics/step/stepper.hpp"
#include "soda/simulation.hpp"

namespace soda {

struct Simulation::Impl {
  explicit Impl(const Scene& of);

  void renew();
  std::size_t place_of(std::uint32_t body) const;  // throws UsageError
  void act(const models::UserInput& input);
  void take_inputs();
  void advance();
  void add(models::UserInput input);

  const Scene scene;
  const Scene::Impl& base;                      // that of the scene
  const std::vector<models::UserInput> script;  // the scene's own, in the order of acting
  Moment now, spare;                            // spare: memory for what is restored
  std::shared_ptr<const physics::SceneDescription> description;  // as inputs have left it
  std::vector<std::uint32_t> labels;                             // of now.ids
  physics::Stepper stepper;
  std::uint64_t made = 0;  // steps, those before a restore too
  std::function<void(const Simulation&)> callback;
  std::optional<NumericalError> failure;
};

}  // namespace soda
