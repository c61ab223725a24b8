// Changes of a scene that should not matter to what they do not concern.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "analysis/whole/scene_parts.hpp"

namespace soda::analysis {

enum class ContinuityKind {
  kTinyForce,       // 1e-12 N on a body
  kFarBody,         // a body where nothing else is
  kFarContact,      // two that touch there
  kFarJoint,        // two that a joint holds there
  kFarSpring,       // two that a spring holds there
  kFarInput,        // one that a user pushes there
  kUnusedMaterial,  // of which nothing is made
  kUnusedDrive,     // that drives nobody
  kDefaultKey,      // a key that says what it says by default
  kLongerRow,       // one more body at the end of a row at rest, touching
  kCount
};
inline constexpr std::size_t kContinuityKinds = static_cast<std::size_t>(ContinuityKind::kCount);
const char* name_of(ContinuityKind kind);
// Throws UsageError for what is none of the names.
std::vector<ContinuityKind> parse_continuity_kinds(const std::vector<std::string>& names);

struct ContinuityPair {
  WholeScene plain, changed;
  double force_newton = 0.0;  // that was added
};

// The scene of a seed for this kind. For all but kLongerRow it is draw_whole_scene's.
WholeScene draw_continuity_scene(std::uint64_t seed, ContinuityKind kind);

// A function of its arguments. Null: the kind finds nothing to change in this scene.
std::optional<ContinuityPair> change(const WholeScene& scene, std::uint64_t seed,
                                     ContinuityKind kind);

// The scene with every body moved by about 1e-13 of the unit, each in a direction of its own: what
// this does, rounding does.
WholeScene shaken(const WholeScene& scene, std::uint64_t seed);

}  // namespace soda::analysis
