#include "models/load_balancing/loads.hpp"

#include <algorithm>

namespace soda::models {
namespace {

// A border face costs this share of the mean load. So a finger of ten cells counts a few percent.
constexpr double kFaceShare = 0.001;

}  // namespace

Loads::Loads(const LoadPicture& picture, const TerritoryMap& map,
             std::span<const std::uint32_t> processor_of, const BalancerOptions& options)
    : picture_(picture),
      processor_of_(processor_of),
      options_(options),
      territories_(map),
      islands_in_(picture.cell_ns.size()),
      parts_(picture.islands.size()),
      load_(*std::max_element(processor_of.begin(), processor_of.end()) + 1, 0.0),
      shared_(load_.size(), 0) {
  for (std::uint32_t island = 0; island < picture.islands.size(); ++island) {
    for (const std::uint32_t cell : picture.islands[island].cells) {
      islands_in_[cell].push_back(island);
      count_part(island, processor_of_[index_of(map.owners()[cell])], true);
    }
    add_island(island, 1);
  }
  for (std::uint32_t cell = 0; cell < picture.cell_ns.size(); ++cell)
    add(processor_of_[index_of(map.owners()[cell])], static_cast<double>(picture.cell_ns[cell]));
  for (const double load : load_) mean_ += load / static_cast<double>(load_.size());
  face_ns_ = kFaceShare * mean_;
  // Each face twice, once from either side.
  for (std::uint32_t cell = 0; cell < picture.cell_ns.size(); ++cell) add_borders(cell, 0.5);
}

std::span<const std::uint32_t> Loads::islands_in(std::uint32_t cell) const {
  return islands_in_[cell];
}

double Loads::gain(std::span<const std::uint32_t> cells, WorldId to) {
  const WorldId from = territories_.owner(cells.front());
  const double before = squares_;
  for (const std::uint32_t cell : cells) give(cell, to);
  const double gained = before - squares_;
  for (const std::uint32_t cell : cells) give(cell, from);
  squares_ = before;
  return gained;
}

bool Loads::move(std::span<const std::uint32_t> cells, WorldId from, WorldId to) {
  if (!territories_.give_in_one_piece(cells, from, to)) return false;
  for (const std::uint32_t cell : cells) territories_.give(cell, from);
  for (const std::uint32_t cell : cells) give(cell, to);
  return true;
}

void Loads::add(std::uint32_t processor, double ns) {
  double& load = load_[processor];
  squares_ -= load * load;
  load += ns;
  squares_ += load * load;
}

// Every processor that has a part solves the whole, and again when news of the other parts comes.
// Of an island that is shared out all do equal parts, wherever its bodies lie; but all of it is
// told to each of them, from owner to owner, and the solve waits for the last.
void Loads::add_island(std::uint32_t island, int sign) {
  const Parts& parts = parts_[island];
  const bool split = parts.size() > 1;
  const double solve_ns = static_cast<double>(picture_.islands[island].solve_ns);
  if (split && picture_.islands[island].is_shared_out) {
    const double owners = static_cast<double>(parts.size());
    const double telling_ns = static_cast<double>(picture_.islands[island].telling_ns);
    const double part_ns = solve_ns / owners + options_.telling_share * owners * telling_ns;
    for (const auto& [processor, cells] : parts) add(processor, sign * part_ns);
    return;
  }
  for (const auto& [processor, cells] : parts) {
    add(processor, sign * (split ? options_.split_factor : 1.0) * solve_ns);
    if (split) shared_[processor] += sign;
  }
}

// Bodies near a face between processors are ghosts on the other side.
void Loads::add_borders(std::uint32_t cell, double sign) {
  const std::uint32_t here = processor_of(territories_.owner(cell));
  for (const std::uint32_t next : face_neighbours(territories_.grid(), cell)) {
    const std::uint32_t there = processor_of(territories_.owner(next));
    if (here == there) continue;
    const double bodies_ns = static_cast<double>(picture_.cell_ns[cell] + picture_.cell_ns[next]);
    const double cost_ns = face_ns_ + options_.border_share * 0.5 * bodies_ns;
    add(here, sign * cost_ns);
    add(there, sign * cost_ns);
  }
}

void Loads::count_part(std::uint32_t island, std::uint32_t processor, bool more) {
  Parts& parts = parts_[island];
  auto part =
      std::find_if(parts.begin(), parts.end(), [&](const auto& p) { return p.first == processor; });
  if (part == parts.end()) part = parts.insert(part, {processor, 0u});
  part->second += more ? 1u : -1u;
  if (part->second == 0) parts.erase(part);
}

void Loads::give(std::uint32_t cell, WorldId to) {
  const std::uint32_t from_processor = processor_of(territories_.owner(cell));
  const std::uint32_t to_processor = processor_of(to);
  const double own_ns = static_cast<double>(picture_.cell_ns[cell]);
  add_borders(cell, -1.0);
  add(from_processor, -own_ns);
  for (const std::uint32_t island : islands_in_[cell]) {
    add_island(island, -1);
    count_part(island, from_processor, false);
    count_part(island, to_processor, true);
    add_island(island, 1);
  }
  territories_.give(cell, to);
  add(to_processor, own_ns);
  add_borders(cell, 1.0);
}

}  // namespace soda::models
