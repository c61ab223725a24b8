// Stepping an undivided scene, for who embeds this layer: step() with the memory that it needs
// behind one pointer.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "physics/model/body_state.hpp"
#include "physics/model/island_report.hpp"
#include "physics/model/scene.hpp"
#include "physics/model/stage_counters.hpp"
#include "physics/shapes/geometry.hpp"

namespace soda::physics {

// Holds nothing that counts: the states after a step are a function of scene and states alone.
class Stepper {
 public:
  Stepper();
  ~Stepper();
  Stepper(Stepper&&) noexcept;
  Stepper& operator=(Stepper&&) noexcept;

  // Advances states[i] of ids[i] (ascending) by one step, as step() does. `geometry` is that of the
  // scene, or of one that differs in materials and motors only.
  void step(const SceneDescription& scene, const Geometry& geometry, std::span<const BodyId> ids,
            std::span<BodyState> states);
  // To be called before a step with other materials or motors than those of the step before.
  void forget();

  // Of the last step.
  const std::vector<IslandReport>& islands() const;  // ascending by label
  const std::vector<AdvanceFault>& faults() const;
  // Of all steps.
  const StageCounters& counters() const;

 private:
  struct Memory;
  std::unique_ptr<Memory> memory_;
};

}  // namespace soda::physics
