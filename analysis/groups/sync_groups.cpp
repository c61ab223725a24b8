#include "analysis/groups/sync_groups.hpp"

#include <algorithm>
#include <functional>
#include <numeric>

namespace soda::analysis {
namespace {

constexpr std::array<std::uint32_t, kGroupClasses> kLargestOfClass{1, 4, 8, ~std::uint32_t{0}};

}  // namespace

SyncGroups::SyncGroups(std::uint32_t worlds) : parent_(worlds) {
  std::iota(parent_.begin(), parent_.end(), 0u);
}

std::uint32_t SyncGroups::root_of(std::uint32_t world) const {
  while (parent_[world] != world) world = parent_[world];
  return world;
}

void SyncGroups::bond(models::WorldId a, models::WorldId b) {
  const auto [least, most] = std::minmax({root_of(index_of(a)), root_of(index_of(b))});
  parent_[most] = least;
  parent_[index_of(a)] = parent_[index_of(b)] = least;
}

std::vector<std::uint32_t> SyncGroups::sizes() const {
  std::vector<std::uint32_t> sizes(parent_.size(), 0);
  for (std::uint32_t world = 0; world < parent_.size(); ++world) ++sizes[root_of(world)];
  std::ranges::sort(sizes, std::greater{});
  sizes.erase(std::ranges::find(sizes, 0u), sizes.end());
  return sizes;
}

GroupShares SyncGroups::shares() const {
  GroupShares shares{};
  for (const std::uint32_t size : sizes()) {
    const auto found = std::ranges::lower_bound(kLargestOfClass, size);
    shares[static_cast<std::size_t>(found - kLargestOfClass.begin())] += size;
  }
  for (double& share : shares) share /= static_cast<double>(parent_.size());
  return shares;
}

void bond_by_overlap(std::span<const physics::Aabb> boxes, std::span<const models::WorldId> owners,
                     const models::TerritoryMap& map, SyncGroups& groups) {
  std::vector<models::WorldId> met;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    map.owners_of(boxes[i], met);
    for (const models::WorldId other : met) groups.bond(owners[i], other);
  }
}

void bond_by_contact(std::span<const physics::ContactManifold> contacts,
                     std::span<const physics::BodyId> ids, std::span<const models::WorldId> owners,
                     SyncGroups& groups) {
  const auto owner_of = [&](physics::BodyId id) {
    return owners[static_cast<std::size_t>(std::ranges::lower_bound(ids, id) - ids.begin())];
  };
  for (const physics::ContactManifold& contact : contacts)
    if (!physics::is_static(contact.b)) groups.bond(owner_of(contact.a), owner_of(contact.b));
}

}  // namespace soda::analysis
