#include "physics/step/stepper.hpp"

#include "physics/step/step.hpp"

namespace soda::physics {

struct Stepper::Memory {
  StepScratch scratch;
  StepReport report;
  StageCounters counters;
};

Stepper::Stepper() : memory_(std::make_unique<Memory>()) {}
Stepper::~Stepper() = default;
Stepper::Stepper(Stepper&&) noexcept = default;
Stepper& Stepper::operator=(Stepper&&) noexcept = default;

void Stepper::step(const SceneDescription& scene, const Geometry& geometry,
                   std::span<const BodyId> ids, std::span<BodyState> states) {
  physics::step(scene, geometry, ids, states,
                {memory_->scratch, memory_->report, memory_->counters});
}

void Stepper::forget() { memory_->scratch.resting.forget(); }

const std::vector<IslandReport>& Stepper::islands() const { return memory_->report.islands; }
const std::vector<AdvanceFault>& Stepper::faults() const { return memory_->report.faults; }
const StageCounters& Stepper::counters() const { return memory_->counters; }

}  // namespace soda::physics
