// Synchronisation groups: worlds that depend on each other in a step, directly or through others.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "models/territory/territory.hpp"
#include "physics/model/contact_manifold.hpp"

namespace soda::analysis {

// The paper's classes of sizes. What a group of up to four worlds costs, any parallel engine
// reaches; beyond eight it limits the whole.
inline constexpr std::size_t kGroupClasses = 4;
inline constexpr std::array<const char*, kGroupClasses> kGroupClassNames{"1", "2-4", "5-8", "9+"};

// Share of the worlds, 0 to 1, that are in groups of each class; the sum is 1.
using GroupShares = std::array<double, kGroupClasses>;

// Of one step. Worlds without bodies count: they are groups of one.
class SyncGroups {
 public:
  explicit SyncGroups(std::uint32_t worlds);  // > 0; nobody depends on anybody

  void bond(models::WorldId a, models::WorldId b);

  std::vector<std::uint32_t> sizes() const;  // of all groups, the largest first
  GroupShares shares() const;

 private:
  std::uint32_t root_of(std::uint32_t world) const;

  std::vector<std::uint32_t> parent_;  // the least world of a group is its own
};

// The paper's bond: a body's box overlaps a cell of another world than its owner's. boxes[i] and
// owners[i] are of the same body.
void bond_by_overlap(std::span<const physics::Aabb> boxes, std::span<const models::WorldId> owners,
                     const models::TerritoryMap& map, SyncGroups& groups);

// What remains where worlds run ahead: bodies of two worlds are in contact, so that an island
// spans them. owners[i] is of ids[i]; ids ascend and hold all bodies that the contacts name.
void bond_by_contact(std::span<const physics::ContactManifold> contacts,
                     std::span<const physics::BodyId> ids, std::span<const models::WorldId> owners,
                     SyncGroups& groups);

}  // namespace soda::analysis
