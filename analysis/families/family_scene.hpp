// What families build their scenes of.
#pragma once

#include <optional>
#include <vector>

#include "analysis/families/family.hpp"

namespace soda::analysis {

inline constexpr double kFamilyGravity_m_s2 = 9.81;
inline constexpr double kFamilyStep_s = 1.0 / 60.0;

// Under gravity along -z, steps of 1/60 s.
FamilyScene scene_under_gravity();
std::uint32_t add_shape(FamilyScene& scene, physics::Shape shape);
// At rest; `mass_kg` spread evenly over its solid. Valid until the next one is added.
physics::BodyState& add_body(FamilyScene& scene, std::uint32_t shape,
                             const physics::Vec3& position_m, double mass_kg,
                             const physics::Material& material = {});
// A solid half of space below z = 0.
void add_floor(FamilyScene& scene, const physics::Material& material);
// A ball joint of two bodies, or of one with the world, at a place in the world.
void add_ball_joint(FamilyScene& scene, std::uint32_t a, std::optional<std::uint32_t> b,
                    const physics::Vec3& anchor_m, double reach_m);
// No two bodies of the scene touch; joints hold them all the same.
void let_pass_through(FamilyScene& scene);

// The i-th of n masses from 1 kg to `ratio` kg, each as many times the one before.
double graded_mass_kg(int i, int n, double ratio);

// Largest distance of the two anchors of any joint.
double largest_joint_gap_m(const FamilyView& view);
// Largest way of any body from where it began.
double largest_way_m(const FamilyView& view, std::span<const physics::BodyState> start);
double energy_joule(const FamilyView& view);

}  // namespace soda::analysis
