// Advancing bodies over one step: the interface behind which solvers are exchanged.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "physics/body_state.hpp"
#include "physics/contact_manifold.hpp"
#include "physics/scene.hpp"
#include "physics/stage_counters.hpp"

namespace soda::physics {

class Geometry;
struct SolveScratch;

// What a solved island has to report. All of it is a function of the island's content.
struct IslandReport {
  BodyId label{};  // smallest id
  std::uint32_t bodies = 0;
  std::uint32_t contact_points = 0;
  bool direct = false;                   // solved by Newton's method (contact_choice.hpp)
  bool rests = false;                    // it ended as it began, bit for bit (rest.hpp)
  std::uint32_t iterations = 0;          // sweeps, and steps of Newton's method
  std::uint64_t multiplications = 0;     // of its factorisations, roughly
  double max_penetration_m = 0.0;        // at the start of the step, >= 0
  double constraint_residual_m_s = 0.0;  // largest remaining violation of a velocity constraint
  // Energy that displacements without velocity gave: push-out of overlaps, closing of joints, in
  // substeps what the way differs from that of the final velocity. Not of islands in blocks.
  // What else contacts do in a step takes energy out (contact_work.hpp).
  double push_out_work_joule = 0.0;
  // Accuracy mode: the error of the step, of the worst body's width (refinement_error.hpp); whether
  // it is more than the tolerance. Else nothing.
  double error_estimate = 0.0;
  BodyId worst_body{};
  bool beyond_tolerance = false;
  double motor_work_joule = 0.0;                          // of motors of joints
  Vec3 static_impulse_newton_s = Vec3::Zero();            // by statics (linkages: linkage.hpp)
  Vec3 static_angular_impulse_newton_m_s = Vec3::Zero();  // about the world origin
};

// A body whose new state would not be finite. It keeps its old one.
struct AdvanceFault {
  BodyId body{};
  std::string what;
};

// Advances the bodies of one island by one step: external forces, contacts, pose. `ids` ascending,
// `states[i]` belongs to ids[i], `manifolds` (canonical order, found at these states) connect them
// with each other and with statics. A function of these arguments only; `scratch` is memory. Faults
// are appended (speculative: never throws).
IslandReport advance_island(const SceneDescription& scene, const Geometry& geometry,
                            std::span<const BodyId> ids, std::span<const ContactManifold> manifolds,
                            std::span<BodyState> states, SolveScratch& scratch,
                            StageCounters& counters, std::vector<AdvanceFault>& faults);

// The same over dt_s > 0, with each contact as the manifolds have it, to the end of that time.
// `accurate`: contacts of several bodies are solved to rounding where that can be afforded, as is
// needed for what is compared with other steps; else they may leave a trace to the next step.
IslandReport advance_once(const SceneDescription& scene, double dt_s, bool accurate,
                          std::span<const BodyId> ids, std::span<const ContactManifold> manifolds,
                          std::span<BodyState> states, SolveScratch& scratch,
                          StageCounters& counters, std::vector<AdvanceFault>& faults);

// What comes after impacts: a lone spring in closed form, else one such step, or as many as the
// motion wants (refinement.hpp).
IslandReport advance_resting(const SceneDescription& scene, const Geometry& geometry, double dt_s,
                             std::span<const BodyId> ids,
                             std::span<const ContactManifold> manifolds,
                             std::span<BodyState> states, SolveScratch& scratch,
                             StageCounters& counters, std::vector<AdvanceFault>& faults);

// Of a later part of the same step: sums, and the largest errors.
void add_part(const IslandReport& part, IslandReport& report);

// Advances one body that touches nothing, by dt_s.
void advance_free_body(const SceneDescription& scene, double dt_s, BodyId id, BodyState& state,
                       StageCounters& counters, std::vector<AdvanceFault>& faults);

}  // namespace soda::physics
