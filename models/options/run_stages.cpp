#include "models/options/run_stages.hpp"

namespace soda::models {

using physics::Need;
using physics::need_of;

namespace {

constexpr const char* kOneWorld = "one world has no borders";
constexpr const char* kInSequence = "the sequential executor never rolls back";

// Balancing is none of it: what it decides is for steps that nobody has begun.
bool has_external_sources(const RunOptions& options) {
  return options.inputs.any() || !options.external_sources.empty();
}

// The second execution takes over what the first one has computed.
bool executes_twice(const RunOptions& options) {
  return options.executor == ExecutorKind::kVirtual && options.cluster.check_purity;
}

}  // namespace

ExecutorKind executor_of(const RunOptions& options, std::uint32_t worlds) {
  return worlds == 1 && options.executor != ExecutorKind::kVirtual ? ExecutorKind::kSequential
                                                                   : options.executor;
}

Need entries_needed(const RunOptions& options, std::uint32_t worlds) {
  if (executor_of(options, worlds) == ExecutorKind::kSequential)
    return {false, worlds > 1 ? kInSequence : kOneWorld};
  return {true, worlds > 1 ? "worlds run ahead of their neighbours"
                           : "the virtual cluster can roll back any LP"};
}

Need rollback_needed(const RunOptions& options, std::uint32_t worlds) {
  const Need entries = entries_needed(options, worlds);
  if (!entries) return entries;
  const bool external = has_external_sources(options);
  if (worlds > 1 && options.synchronisation == kernel::Synchronisation::kOptimistic)
    return {true, "a neighbour's body can turn out to have mattered"};
  return need_of(external, "what comes from outside can come late",
                 worlds > 1 ? "in lockstep nothing comes late" : kOneWorld);
}

Need repetition_needed(const RunOptions& options, std::uint32_t worlds) {
  const Need rollback = rollback_needed(options, worlds);
  if (!rollback && !executes_twice(options)) return rollback;
  if (worlds == 1) return {false, "one world repeats whole steps"};
  if (options.rollback == RollbackMode::kInvalidate)
    return {false, "rollbacks invalidate whole entries"};
  return {true, options.rollback == RollbackMode::kWarm
                    ? "repeated steps compute only what changed, from multipliers that depend on "
                      "history"
                    : "repeated steps compute only what changed"};
}

Need borders_needed(std::uint32_t worlds) {
  return need_of(worlds > 1, "space is divided", kOneWorld);
}

Need shared_contacts_needed(const physics::SceneDescription& scene, std::uint32_t worlds) {
  if (worlds == 1) return {false, kOneWorld};
  return need_of(scene.bodies.size() > 1, "contacts can have two owners",
                 "one body has no contact with another");
}

Need balancing_needed(const RunOptions& options, std::uint32_t worlds) {
  if (worlds == 1) return {false, kOneWorld};
  return need_of(options.balancing.policy != BalancingPolicy::kOff,
                 "cells move to worlds that have less to do", "switched off");
}

}  // namespace soda::models
