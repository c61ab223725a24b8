// Absorbing ghosts that touch nothing: a late one costs its receiver no restart.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "kernel/api/logical_process.hpp"
#include "models/messages/messages.hpp"
#include "models/territory/territory.hpp"
#include "models/transform_buffer/step_memo.hpp"
#include "physics/model/scene.hpp"
#include "physics/shapes/geometry.hpp"

namespace soda::models {

// That own body number `own` covers this border cell, as a number to be sorted by.
inline std::uint64_t border_key(std::uint32_t cell, std::size_t own) {
  return std::uint64_t{cell} << 32 | own;
}
// Sorts the keys and overwrites `index` with what they stand for. `ids` ascend.
void index_border(std::span<const physics::BodyId> ids, std::span<const physics::Aabb> boxes,
                  std::vector<std::uint64_t>& keys, std::vector<StepMemo::BorderBody>& index);

// A step that a world has executed at least as far as its pairs.
struct ExecutedStep {
  const TerritoryMap& map;
  const physics::SceneDescription& scene;
  const physics::Geometry& geometry;
  WorldId self;
  std::span<const Ghost> ghosts;                // that it had; ascending by id
  std::function<bool(physics::BodyId)> is_own;  // during the step
  // Of an own body at the start of the step; none if it is not known.
  std::function<std::optional<physics::BodyState>(physics::BodyId)> begin_state;
  std::function<std::span<const StepMemo::BorderBody>(std::uint32_t cell)> border_bodies;
  std::span<const StepMemo::SentWay> sent;  // ways of what impacts have sent on
  bool connects = false;                    // further passes have made a difference
  // Of the contacts that this world tested: how many, and the other body of one that the body has.
  std::size_t contacts = 0;
  std::function<std::optional<physics::BodyId>(physics::BodyId)> contact_of;
};

// Whether the step comes out as it did with these ghosts instead of those it had: of the contacts
// that this world has to test, no old ghost that is gone or changed had one, and no new or changed
// one makes one, or may be met by what was sent on. `ghosts` ascending by id and unique. Looks only
// at bodies in the border cells that the new ghosts cover, at ghosts and at contacts; `looked_at`
// is raised by their number. If not, `why` says for whom (Refused in event_kinds.hpp).
bool makes_no_difference(const ExecutedStep& step, std::span<const Ghost> ghosts,
                         physics::StageCounters& counters, std::uint64_t& looked_at,
                         kernel::Refusal& why);

// Whether a body that is sent on, which this world has not received, makes none either: it
// comes near no own body, and no foreign one in a cell of this world.
bool is_out_of_reach(const ExecutedStep& step, const Ghost& sent, std::uint64_t& looked_at);

}  // namespace soda::models
