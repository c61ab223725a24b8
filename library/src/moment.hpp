// A simulation at a moment, and as bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "models/user_input/scene_versions.hpp"
#include "models/user_input/user_input.hpp"
#include "physics/model/body_state.hpp"
#include "physics/model/scene.hpp"

namespace soda {

// All that the next steps depend on, beside the scene.
struct Moment {
  std::int64_t step = 0;
  std::vector<physics::BodyId> ids;  // ascending; the other bodies are absent
  std::vector<physics::BodyState> states;
  models::SceneChanges changes;
  std::vector<models::UserInput> given;  // to come, not the scene's own; in the order of acting
};

// Overwrites `bytes`. `fingerprint` is that of the scene.
void encode(const Moment& moment, std::uint64_t fingerprint, std::vector<std::byte>& bytes);

// Overwrites `moment`, whatever comes of it. Throws UsageError if the bytes are damaged, or of
// another scene; bytes that somebody has forged make a moment of this scene or are refused.
void decode(std::span<const std::byte> bytes, const physics::SceneDescription& scene,
            std::uint64_t fingerprint, Moment& moment);

}  // namespace soda
