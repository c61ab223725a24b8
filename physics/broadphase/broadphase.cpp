#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>
#include <vector>

#include "physics/model/stage_counters.hpp"
#include "physics/shapes/geometry.hpp"

// A stateless multi-level grid. Every box is entered once, in the cell of its lowest corner on a
// level whose cells are no smaller than the box; two overlapping boxes then lie in cells of the
// coarser level that differ by at most one in each axis. Each level is sorted by cell, so that all
// boxes are visited in the order of memory. Cells farther than 2^19 from the middle count as the
// outermost ones, which leaves neighbours neighbours: nothing is too far, it only costs tests, as
// every candidate is tested exactly.
namespace soda::physics {
namespace {

constexpr std::size_t kBruteForceLimit = 24;  // below this, n(n-1)/2 tests are the cheaper way
constexpr int kMinExponent = -200;            // points and slivers are binned as if 2^-200 m
constexpr int kMaxExponent = 1000;            // from here on, everything is in one cell
constexpr int kLevelSpan = 2;                 // powers of two that share a level

constexpr int kFarthestCell = 1 << 19;

struct Cell {
  std::array<std::int32_t, 3> at{};
};

struct Level {
  double inverse_size = 1.0;  // 0: one cell for all of space
};

// The factor covers the rounding of the extent itself.
double extent_of(const Aabb& box) { return (box.max - box.min).maxCoeff() * (1.0 + 1e-12); }

// Smallest e with extent < 2^e.
int size_exponent(double extent) {
  if (!(extent < 1e300)) return kMaxExponent;
  if (extent <= 0.0) return kMinExponent;
  const int exponent = static_cast<int>(std::bit_cast<std::uint64_t>(extent) >> 52) - 1022;
  return std::max(exponent, kMinExponent);
}

// Cells as large as the level's largest box, so that they hold few. The spare covers the rounding
// of coordinates in cells, of which there are not more than kFarthestCell either way.
Level make_level(int exponent, double largest_extent) {
  constexpr double kSpare = 1.0 + 1e-6;
  return exponent >= kMaxExponent ? Level{0.0} : Level{1.0 / (largest_extent * kSpare)};
}

// Levels span two powers of two and are anchored at the most frequent size, so that bodies of one
// size, whose boxes differ by rotation only, share one level.
struct Levels {
  std::vector<Level> levels;  // from fine to coarse, those in use only
  std::vector<std::uint32_t> of_box;
};

Levels choose_levels(std::span<const Aabb> boxes) {
  constexpr int kCount = kMaxExponent - kMinExponent + 1;
  std::vector<std::uint32_t> frequency(kCount + kLevelSpan, 0);
  std::vector<double> largest(kCount + kLevelSpan, 0.0);
  std::vector<int> exponent(boxes.size());
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const double extent = extent_of(boxes[i]);
    const int e = size_exponent(extent) - kMinExponent;
    exponent[i] = e;
    ++frequency[e];
    largest[e] = std::max(largest[e], extent);
  }
  const int mode =
      static_cast<int>(std::max_element(frequency.begin(), frequency.end()) - frequency.begin());
  const bool above = frequency[mode + 1] > 0;
  const int phase = (mode + (above ? 1 : 0)) % kLevelSpan;  // exponents = phase are level tops
  const auto top_of = [&](int e) { return e + (phase - e % kLevelSpan + kLevelSpan) % kLevelSpan; };

  Levels out;
  std::vector<std::uint32_t> level_of(kCount, 0);
  for (int e = 0; e < kCount;) {
    const int top = top_of(e);
    double extent = 0.0;
    bool used = false;
    for (; e <= top && e < kCount; ++e) {
      level_of[e] = static_cast<std::uint32_t>(out.levels.size());
      extent = std::max(extent, largest[e]);
      used = used || frequency[e] > 0;
    }
    if (used) out.levels.push_back(make_level(top + kMinExponent, extent));
  }
  out.of_box.resize(boxes.size());
  for (std::size_t i = 0; i < boxes.size(); ++i) out.of_box[i] = level_of[exponent[i]];
  return out;
}

std::int32_t cell_index(double coordinate, double origin, double inverse_size) {
  if (inverse_size == 0.0) return 0;
  const double scaled = (coordinate - origin) * inverse_size;
  if (!(scaled > -kFarthestCell)) return -kFarthestCell;
  if (scaled >= kFarthestCell) return kFarthestCell;
  // Floor by truncation: without SSE4 the library's floor is a call.
  const auto truncated = static_cast<std::int32_t>(scaled);
  return truncated - (scaled < truncated ? 1 : 0);
}

// Middle of a few boxes on each axis: among most of the others.
Vec3 origin_of(std::span<const Aabb> boxes) {
  constexpr std::size_t kSamples = 9;
  Vec3 origin;
  for (int axis = 0; axis < 3; ++axis) {
    std::array<double, kSamples> samples;
    for (std::size_t i = 0; i < kSamples; ++i)
      samples[i] = boxes[i * (boxes.size() - 1) / (kSamples - 1)].min[axis];
    std::nth_element(samples.begin(), samples.begin() + kSamples / 2, samples.end());
    origin[axis] = samples[kSamples / 2];
  }
  return origin;
}

struct Entry {
  std::uint64_t key = 0;
  std::uint32_t box = 0;
};

// By key, of which all bits above `bits` are zero.
void sort_entries(int bits, std::vector<Entry>& entries) {
  const int digit = entries.size() < 1024 ? 8 : 11;
  const std::uint64_t mask = (std::uint64_t{1} << digit) - 1;
  std::vector<Entry> sorted(entries.size());
  std::vector<std::uint32_t> place(mask + 1);
  for (int shift = 0; shift < bits; shift += digit) {
    std::fill(place.begin(), place.end(), 0);
    for (const Entry& entry : entries) ++place[entry.key >> shift & mask];
    std::uint32_t next = 0;
    for (std::uint32_t& count : place) next += std::exchange(count, next);
    for (const Entry& entry : entries) sorted[place[entry.key >> shift & mask]++] = entry;
    entries.swap(sorted);
  }
}

// The boxes of one level, by cell: x, then y, then z. Keys have room for one cell more all around,
// so that those of neighbours differ by constants.
class LevelGrid {
 public:
  LevelGrid(const Level& level, const Vec3& origin, std::span<const Aabb> boxes,
            std::span<const std::uint32_t> members)
      : level_(level), origin_(origin) {
    std::vector<Cell> cells;
    cells.reserve(members.size());
    entries_.reserve(members.size());
    for (const std::uint32_t box : members) cells.push_back(cell_of(boxes[box]));
    lowest_ = highest_ = cells.front();
    for (const Cell& cell : cells) {
      for (int axis = 0; axis < 3; ++axis) {
        lowest_.at[axis] = std::min(lowest_.at[axis], cell.at[axis]);
        highest_.at[axis] = std::max(highest_.at[axis], cell.at[axis]);
      }
    }
    std::array<int, 3> bits;
    for (int axis = 0; axis < 3; ++axis) {
      const auto range = static_cast<std::uint32_t>(highest_.at[axis] - lowest_.at[axis]);
      bits[axis] = std::bit_width(range + 2);
    }
    y_shift_ = bits[2];
    x_shift_ = bits[2] + bits[1];
    for (std::size_t i = 0; i < members.size(); ++i)
      entries_.push_back({key_of(cells[i]), members[i]});
    sort_entries(bits[0] + bits[1] + bits[2], entries_);
    boxes_.reserve(entries_.size());
    for (const Entry& entry : entries_) boxes_.push_back(boxes[entry.box]);
  }

  Cell cell_of(const Aabb& box) const {
    Cell cell;
    for (int axis = 0; axis < 3; ++axis)
      cell.at[axis] = cell_index(box.min[axis], origin_[axis], level_.inverse_size);
    return cell;
  }

  // Overlapping pairs of members: in one cell or in neighbouring ones. Of a cell's 26 neighbours,
  // the 13 that come after it; the others find this cell among theirs.
  template <typename Visit>
  void visit_own(Visit visit) const {
    const std::int64_t x = std::int64_t{1} << x_shift_, y = std::int64_t{1} << y_shift_;
    const std::array<std::int64_t, 4> columns = {y, x - y, x, x + y};
    std::array<std::size_t, 4> begin{};
    const std::size_t count = entries_.size();
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint64_t key = entries_[i].key;
      const auto test = [&](std::size_t k) {
        if (overlap(boxes_[i], boxes_[k])) visit(entries_[i].box, entries_[k].box);
      };
      for (std::size_t k = i + 1; k < count && entries_[k].key <= key + 1; ++k) test(k);
      for (std::size_t c = 0; c < columns.size(); ++c) {
        const std::uint64_t middle = key + static_cast<std::uint64_t>(columns[c]);
        std::size_t k = begin[c];
        while (k < count && entries_[k].key < middle - 1) ++k;
        begin[c] = k;
        for (; k < count && entries_[k].key <= middle + 1; ++k) test(k);
      }
    }
  }

  // The members that overlap `box`: in its cell on this level, and in those around it.
  template <typename Visit>
  void visit_around(const Aabb& box, Visit visit) const {
    Cell cell = cell_of(box);
    for (int axis = 0; axis < 3; ++axis)
      if (cell.at[axis] < lowest_.at[axis] - 1 || cell.at[axis] > highest_.at[axis] + 1) return;
    const auto z_from = std::max(cell.at[2] - 1, lowest_.at[2]);
    const auto z_to = std::min(cell.at[2] + 1, highest_.at[2]);
    for (int x = std::max(cell.at[0] - 1, lowest_.at[0]);
         x <= std::min(cell.at[0] + 1, highest_.at[0]); ++x) {
      for (int y = std::max(cell.at[1] - 1, lowest_.at[1]);
           y <= std::min(cell.at[1] + 1, highest_.at[1]); ++y) {
        const std::uint64_t last = key_of({{x, y, z_to}});
        auto entry =
            std::lower_bound(entries_.begin(), entries_.end(), key_of({{x, y, z_from}}),
                             [](const Entry& e, std::uint64_t key) { return e.key < key; });
        for (; entry != entries_.end() && entry->key <= last; ++entry)
          if (overlap(box, boxes_[entry - entries_.begin()])) visit(entry->box);
      }
    }
  }

 private:
  std::uint64_t key_of(const Cell& cell) const {
    const auto part = [&](int axis) {
      const std::int32_t place = cell.at[axis] - lowest_.at[axis] + 1;
      return static_cast<std::uint64_t>(place);
    };
    return part(0) << x_shift_ | part(1) << y_shift_ | part(2);
  }

  const Level level_;
  const Vec3 origin_;
  Cell lowest_, highest_;
  int x_shift_ = 0, y_shift_ = 0;
  std::vector<Entry> entries_;
  std::vector<Aabb> boxes_;  // in the order of the entries
};

void find_in_grid(std::span<const Aabb> boxes, std::vector<IndexPair>& pairs) {
  const Levels levels = choose_levels(boxes);
  const Vec3 origin = origin_of(boxes);
  std::vector<std::vector<std::uint32_t>> members(levels.levels.size());
  for (std::uint32_t i = 0; i < boxes.size(); ++i) members[levels.of_box[i]].push_back(i);
  std::vector<LevelGrid> grids;
  for (std::size_t level = 0; level < members.size(); ++level)
    grids.emplace_back(levels.levels[level], origin, boxes, members[level]);
  const auto add = [&pairs](std::uint32_t i, std::uint32_t j) {
    pairs.push_back({std::min(i, j), std::max(i, j)});
  };
  for (std::size_t level = 0; level < grids.size(); ++level) {
    grids[level].visit_own(add);
    for (std::size_t coarser = level + 1; coarser < grids.size(); ++coarser)
      for (const std::uint32_t i : members[level])
        grids[coarser].visit_around(boxes[i], [&](std::uint32_t j) { add(i, j); });
  }
}

// Counting sort by the first index, then each short run by the second.
void sort_pairs(std::size_t boxes, std::vector<IndexPair>& pairs) {
  if (pairs.size() < 64) {
    std::sort(pairs.begin(), pairs.end());
    return;
  }
  std::vector<std::uint32_t> begin(boxes + 1, 0);
  for (const IndexPair& p : pairs) ++begin[p.first + 1];
  for (std::size_t i = 1; i < begin.size(); ++i) begin[i] += begin[i - 1];
  std::vector<IndexPair> sorted(pairs.size());
  std::vector<std::uint32_t> next(begin.begin(), begin.end() - 1);
  for (const IndexPair& p : pairs) sorted[next[p.first]++] = p;
  for (std::size_t i = 0; i < boxes; ++i) {
    if (begin[i + 1] - begin[i] > 1) {
      std::sort(sorted.begin() + begin[i], sorted.begin() + begin[i + 1]);
    }
  }
  pairs.swap(sorted);
}

void find_all_pairs(std::span<const Aabb> boxes, std::vector<IndexPair>& pairs) {
  for (std::uint32_t i = 0; i < boxes.size(); ++i) {
    for (std::uint32_t j = i + 1; j < boxes.size(); ++j) {
      if (overlap(boxes[i], boxes[j])) pairs.push_back({i, j});
    }
  }
}

}  // namespace

void find_pairs(Broadphase broadphase, std::span<const Aabb> boxes, std::vector<IndexPair>& pairs,
                StageCounters& counters) {
  pairs.clear();
  if (broadphase == Broadphase::kAllPairs || boxes.size() <= kBruteForceLimit) {
    find_all_pairs(boxes, pairs);
  } else {
    find_in_grid(boxes, pairs);
    sort_pairs(boxes.size(), pairs);
  }
  counters.candidate_pairs += pairs.size();
}

}  // namespace soda::physics
