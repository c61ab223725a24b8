// Where a body stands among those of an island.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

#include "physics/model/ids.hpp"

namespace soda::physics {

// Of `id` in `ids`, which ascend and hold it. A static stands after them all.
inline std::uint32_t place_of(std::span<const BodyId> ids, BodyId id) {
  if (is_static(id)) return static_cast<std::uint32_t>(ids.size());
  return static_cast<std::uint32_t>(std::lower_bound(ids.begin(), ids.end(), id) - ids.begin());
}

}  // namespace soda::physics
