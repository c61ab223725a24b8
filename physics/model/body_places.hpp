// Where a body stands among those of an island.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <stdexcept>

#include "physics/model/ids.hpp"

namespace soda::physics {

// Of `id` in `ids`, which ascend; std::logic_error if they do not hold it. A static stands after
// them all.
inline std::uint32_t place_of(std::span<const BodyId> ids, BodyId id) {
  if (is_static(id)) return static_cast<std::uint32_t>(ids.size());
  const auto at = std::lower_bound(ids.begin(), ids.end(), id);
  if (at == ids.end() || *at != id) throw std::logic_error("no place for a body of another island");
  return static_cast<std::uint32_t>(at - ids.begin());
}

}  // namespace soda::physics
