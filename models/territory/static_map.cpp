#include "models/territory/static_map.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>
#include <utility>
#include <variant>

namespace soda::models {
namespace {

using Cell = std::array<std::int32_t, 3>;
using physics::Vec3;

// Share of the room by which a side may differ from its due, for the sake of a shorter border.
constexpr double kSlack = 0.25;

class Environment {
 public:
  Environment(const Grid& grid, const physics::SceneDescription& scene) : grid_(grid) {
    for (const physics::StaticBody& fixed : scene.statics)
      if (const auto* box = std::get_if<physics::Box>(&scene.shapes[fixed.shape]))
        walls_.push_back({fixed.position_m, fixed.orientation, box->half_extents_m});
    room_.resize(grid.cell_count());
    open_.resize(grid.cell_count());
    for (Cell cell{}; cell[0] < grid.cells[0]; ++cell[0])
      for (cell[1] = 0; cell[1] < grid.cells[1]; ++cell[1])
        for (cell[2] = 0; cell[2] < grid.cells[2]; ++cell[2]) note(cell);
  }

  bool has_room(const Cell& cell) const { return room_[grid_.index_of_cell(cell)]; }
  // Whether bodies can pass from the cell to the next one along the axis.
  bool is_open(const Cell& cell, int axis) const {
    return open_[grid_.index_of_cell(cell)][static_cast<std::size_t>(axis)];
  }

 private:
  struct Wall {
    Vec3 position_m;
    physics::Quat orientation;
    Vec3 half_extents_m;
  };

  Vec3 centre_of(const Cell& cell) const {
    return grid_.origin_m + grid_.cell_size_m * Vec3(cell[0] + 0.5, cell[1] + 0.5, cell[2] + 0.5);
  }

  void note(const Cell& cell) {
    const std::size_t index = grid_.index_of_cell(cell);
    const Vec3 from = centre_of(cell);
    room_[index] = !is_blocked(from, from);
    for (int axis = 0; axis < 3; ++axis) {
      Vec3 to = from;
      to[axis] += grid_.cell_size_m;
      open_[index][static_cast<std::size_t>(axis)] = !is_blocked(from, to);
    }
  }

  // Whether the segment meets a wall: clipped against its slabs.
  bool is_blocked(const Vec3& from, const Vec3& to) const {
    return std::any_of(walls_.begin(), walls_.end(), [&](const Wall& wall) {
      const Vec3 a = wall.orientation.conjugate() * (from - wall.position_m);
      const Vec3 b = wall.orientation.conjugate() * (to - wall.position_m);
      double first = 0.0, last = 1.0;
      for (int axis = 0; axis < 3; ++axis) {
        const double half = wall.half_extents_m[axis], step = b[axis] - a[axis];
        if (step == 0.0) {
          if (std::abs(a[axis]) > half) return false;
          continue;
        }
        const double x = (-half - a[axis]) / step, y = (half - a[axis]) / step;
        first = std::max(first, std::min(x, y));
        last = std::min(last, std::max(x, y));
      }
      return first <= last;
    });
  }

  const Grid& grid_;
  std::vector<Wall> walls_;
  std::vector<char> room_;
  std::vector<std::array<char, 3>> open_;
};

// A box of cells [low, high) still to be divided among `worlds` from first_world on.
struct Part {
  Cell low, high;
  std::uint32_t first_world, worlds;
};

template <class Visit>
void for_each_cell(const Part& part, const Visit& visit) {
  Cell cell;
  for (cell[0] = part.low[0]; cell[0] < part.high[0]; ++cell[0])
    for (cell[1] = part.low[1]; cell[1] < part.high[1]; ++cell[1])
      for (cell[2] = part.low[2]; cell[2] < part.high[2]; ++cell[2]) visit(cell);
}

// A cut across `axis` below layer `at`. The better one is less.
struct Cut {
  bool unbalanced = true;
  double open_faces = 0.0;
  double off_balance = 0.0;
  int axis = 0;
  std::int32_t at = 0;
  std::uint32_t lower_worlds = 1;

  auto key() const { return std::tuple(unbalanced, open_faces, off_balance, axis, at); }
};

// Along one axis: room in each layer, and open faces between each and the next.
struct Profile {
  std::vector<double> room, open_faces;
};

Profile profile_of(const Environment& environment, const Part& part, int axis) {
  const auto layers = static_cast<std::size_t>(part.high[axis] - part.low[axis]);
  Profile profile{std::vector<double>(layers, 0.0), std::vector<double>(layers, 0.0)};
  for_each_cell(part, [&](const Cell& cell) {
    const auto layer = static_cast<std::size_t>(cell[axis] - part.low[axis]);
    profile.room[layer] += environment.has_room(cell);
    profile.open_faces[layer] += environment.is_open(cell, axis);
  });
  return profile;
}

std::int64_t cells_in(const Part& part) {
  std::int64_t cells = 1;
  for (int axis = 0; axis < 3; ++axis) cells *= part.high[axis] - part.low[axis];
  return cells;
}

Cut best_cut(const Environment& environment, const Part& part) {
  std::optional<Cut> best;
  for (int axis = 0; axis < 3; ++axis) {
    const Profile profile = profile_of(environment, part, axis);
    const std::int64_t layer = cells_in(part) / (part.high[axis] - part.low[axis]);
    double all = 0.0, below = 0.0;
    for (const double room : profile.room) all += room;
    for (std::int32_t at = part.low[axis] + 1; at < part.high[axis]; ++at) {
      const auto last = static_cast<std::size_t>(at - part.low[axis] - 1);
      below += profile.room[last];
      const double share = all > 0.0 ? below / all : 0.5;
      const std::int64_t worlds = part.worlds;
      const std::int64_t lower = std::clamp<std::int64_t>(
          std::llround(share * static_cast<double>(worlds)),
          std::max<std::int64_t>(1, worlds - (part.high[axis] - at) * layer),
          std::min(worlds - 1, (at - part.low[axis]) * layer));
      const double due = static_cast<double>(lower) / static_cast<double>(worlds);
      const double off = std::abs(share - due);
      const bool halves = 3 * lower >= worlds && 3 * (worlds - lower) >= worlds;
      const bool unbalanced = off > kSlack * due || !halves;
      // Where balance cannot be had, the least evil counts, not the shortest border.
      const Cut cut{unbalanced, unbalanced ? off : profile.open_faces[last],
                    off,        axis,
                    at,         static_cast<std::uint32_t>(lower)};
      if (!best || cut.key() < best->key()) best = cut;
    }
  }
  return best.value_or(Cut{});
}

}  // namespace

TerritoryMap make_static_map(const Grid& grid, std::uint32_t worlds,
                             const physics::SceneDescription& scene) {
  const Environment environment(grid, scene);
  std::vector<WorldId> owners(grid.cell_count(), WorldId{0});
  std::vector<Part> open{{{0, 0, 0}, grid.cells, 0, worlds}};
  while (!open.empty()) {
    const Part part = open.back();
    open.pop_back();
    if (part.worlds == 1) {
      for_each_cell(part, [&](const Cell& cell) {
        owners[grid.index_of_cell(cell)] = WorldId{part.first_world};
      });
      continue;
    }
    const Cut cut = best_cut(environment, part);
    Part lower = part, upper = part;
    lower.high[cut.axis] = upper.low[cut.axis] = cut.at;
    lower.worlds = cut.lower_worlds;
    upper.first_world += lower.worlds;
    upper.worlds -= lower.worlds;
    open.push_back(lower);
    open.push_back(upper);
  }
  return {grid, worlds, std::move(owners)};
}

}  // namespace soda::models
