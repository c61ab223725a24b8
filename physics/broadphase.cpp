#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "physics/geometry.hpp"

// A stateless multi-level grid. Every box is entered once, in the cell of its lowest corner on a
// level whose cells are no smaller than the box; two overlapping boxes then lie in cells of the
// coarser level that differ by at most one in each axis. Cell coordinates wrap around at 2^20, so
// that no position is too far: aliases only cost tests, as every candidate is tested exactly.
namespace soda::physics {
namespace {

constexpr std::size_t kBruteForceLimit = 24;  // below this, n(n-1)/2 tests are the cheaper way
constexpr int kMinExponent = -200;            // points and slivers are binned as if 2^-200 m
constexpr int kMaxExponent = 1000;            // from here on, everything is in one cell
constexpr int kLevelSpan = 2;                 // powers of two that share a level

struct Entry {
  std::uint64_t cell = 0;
  std::uint32_t box = 0;
  std::uint32_t level = 0;
};

struct Cell {
  std::int64_t x = 0, y = 0, z = 0;
};

struct Level {
  double inverse_size = 1.0;  // 0: one cell for all of space
};

// The factor covers the rounding of the extent itself.
double extent_of(const Aabb& box) { return (box.max - box.min).maxCoeff() * (1.0 + 1e-12); }

// Smallest e with extent < 2^e.
int size_exponent(double extent) {
  if (!(extent < 1e300)) return kMaxExponent;
  int exponent = 0;
  std::frexp(extent, &exponent);
  return std::clamp(exponent, kMinExponent, kMaxExponent);
}

std::int64_t wrapped_index(double coordinate, double inverse_size) {
  const double scaled = coordinate * inverse_size;
  if (std::abs(scaled) < 4.5e15) {
    // Floor by truncation: without SSE4 the library's floor is a call.
    const std::int64_t truncated = static_cast<std::int64_t>(scaled);
    return (truncated - (scaled < static_cast<double>(truncated) ? 1 : 0)) & 0xfffff;
  }
  // Above 2^52 cells, distinct corners are farther apart than the boxes are wide: only equal
  // indices can overlap, so any function of the index will do.
  const double index = std::floor(scaled);
  return std::isfinite(index) ? static_cast<std::int64_t>(std::fmod(index, 1048576.0)) & 0xfffff
                              : 0;
}

Cell cell_of(const Aabb& box, const Level& level) {
  return {wrapped_index(box.min.x(), level.inverse_size),
          wrapped_index(box.min.y(), level.inverse_size),
          wrapped_index(box.min.z(), level.inverse_size)};
}

std::uint64_t wrapped(std::int64_t i) { return static_cast<std::uint64_t>(i) & 0xfffff; }

std::uint64_t key_of(std::uint32_t level, const Cell& c) {
  return (static_cast<std::uint64_t>(level & 0xf) << 60) | wrapped(c.x) << 40 | wrapped(c.y) << 20 |
         wrapped(c.z);
}

Cell cell_of_key(std::uint64_t key) {
  return {static_cast<std::int64_t>(key >> 40 & 0xfffff),
          static_cast<std::int64_t>(key >> 20 & 0xfffff), static_cast<std::int64_t>(key & 0xfffff)};
}

// Cells above each other have neighbouring buckets: a column of three is one stretch of memory.
std::uint64_t bucket_of(std::uint32_t level, const Cell& c) {
  std::uint64_t column =
      (static_cast<std::uint64_t>(level) << 40) | wrapped(c.x) << 20 | wrapped(c.y);
  column *= 0x9e3779b97f4a7c15u;
  return (column >> 32) + wrapped(c.z);
}

// Cells as large as the level's largest box, so that they hold few. Where coordinates are so large
// that scaling them would round by a noticeable part of a cell, a power of two, which scales
// exactly.
Level make_level(int exponent, double largest_extent, double largest_coordinate) {
  constexpr double kSpare = 1.0 + 1e-6;
  constexpr double kFarthest = 1e8;  // cells; rounding is then 1e-8 of a cell, far below the spare
  if (exponent >= kMaxExponent) return {0.0};
  const double inverse_size = 1.0 / (largest_extent * kSpare);
  if (largest_coordinate * inverse_size < kFarthest) return {inverse_size};
  return {std::ldexp(1.0, -exponent)};
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
  double largest_coordinate = 0.0;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const double extent = extent_of(boxes[i]);
    const int e = size_exponent(extent) - kMinExponent;
    exponent[i] = e;
    ++frequency[e];
    largest[e] = std::max(largest[e], extent);
    largest_coordinate = std::max(largest_coordinate, boxes[i].min.cwiseAbs().maxCoeff());
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
    if (used) out.levels.push_back(make_level(top + kMinExponent, extent, largest_coordinate));
  }
  out.of_box.resize(boxes.size());
  for (std::size_t i = 0; i < boxes.size(); ++i) out.of_box[i] = level_of[exponent[i]];
  return out;
}

// Entries grouped by hash bucket (counting sort). A lookup scans one bucket.
class CellTable {
 public:
  CellTable(std::span<const Aabb> boxes, const Levels& levels) {
    std::size_t buckets = 64;
    while (buckets < 2 * boxes.size()) buckets *= 2;
    mask_ = buckets - 1;
    begin_.assign(buckets + 1, 0);
    std::vector<Entry> unsorted(boxes.size());
    std::vector<std::uint32_t> bucket(boxes.size());
    for (std::uint32_t i = 0; i < boxes.size(); ++i) {
      const std::uint32_t level = levels.of_box[i];
      const Cell c = cell_of(boxes[i], levels.levels[level]);
      unsorted[i] = {key_of(level, c), i, level};
      bucket[i] = static_cast<std::uint32_t>(bucket_of(level, c) & mask_);
      ++begin_[bucket[i] + 1];
    }
    for (std::size_t b = 1; b < begin_.size(); ++b) begin_[b] += begin_[b - 1];
    entries_.resize(boxes.size());
    std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
    for (std::uint32_t i = 0; i < boxes.size(); ++i) entries_[next[bucket[i]]++] = unsorted[i];
  }

  const std::vector<Entry>& entries() const { return entries_; }

  // Boxes in the cells from c to `height` cells above it.
  template <typename Visit>
  void for_column(std::uint32_t level, Cell c, std::uint64_t height, Visit visit) const {
    const std::uint64_t first = bucket_of(level, c) & mask_;
    const std::uint64_t key = key_of(level, c);
    if (first + height <= mask_ && wrapped(c.z) + height <= 0xfffff) {
      // The column's buckets follow each other, and so do its keys.
      visit_range(begin_[first], begin_[first + height + 1], level, key, height, visit);
      return;
    }
    for (std::uint64_t i = 0; i <= height; ++i, ++c.z) {
      const std::uint64_t bucket = bucket_of(level, c) & mask_;
      visit_range(begin_[bucket], begin_[bucket + 1], level, key_of(level, c), 0, visit);
    }
  }

 private:
  template <typename Visit>
  void visit_range(std::uint32_t begin, std::uint32_t end, std::uint32_t level, std::uint64_t key,
                   std::uint64_t height, Visit visit) const {
    for (std::uint32_t e = begin; e < end; ++e) {
      const Entry& entry = entries_[e];
      if (entry.cell - key <= height && entry.level == level) visit(entry.box);
    }
  }

  std::size_t mask_ = 0;
  std::vector<std::uint32_t> begin_;
  std::vector<Entry> entries_;
};

// Of a cell's 26 neighbours, the 13 that come after it; the others find this cell among theirs.
void find_on_own_level(std::span<const Aabb> boxes, const Levels& levels, const CellTable& table,
                       std::vector<IndexPair>& pairs) {
  constexpr std::array<std::array<int, 2>, 4> kColumns = {{{0, 1}, {1, -1}, {1, 0}, {1, 1}}};
  for (const Entry& entry : table.entries()) {
    const std::uint32_t i = entry.box, level = entry.level;
    const Cell c = cell_of_key(entry.cell);
    const auto test = [&](std::uint32_t j) {
      if (overlap(boxes[i], boxes[j])) pairs.push_back({std::min(i, j), std::max(i, j)});
    };
    table.for_column(level, c, 0, [&](std::uint32_t j) {
      if (i < j) test(j);
    });
    if (levels.levels[level].inverse_size == 0.0) continue;
    table.for_column(level, {c.x, c.y, c.z + 1}, 0, test);
    for (const auto& [dx, dy] : kColumns) {
      table.for_column(level, {c.x + dx, c.y + dy, c.z - 1}, 2, test);
    }
  }
}

void find_on_coarser_levels(std::span<const Aabb> boxes, const Levels& levels,
                            const CellTable& table, std::vector<IndexPair>& pairs) {
  for (const Entry& entry : table.entries()) {
    const std::uint32_t i = entry.box;
    const auto test = [&](std::uint32_t j) {
      if (overlap(boxes[i], boxes[j])) pairs.push_back({std::min(i, j), std::max(i, j)});
    };
    for (std::uint32_t level = entry.level + 1; level < levels.levels.size(); ++level) {
      const Cell c = cell_of(boxes[i], levels.levels[level]);
      const std::int64_t reach = levels.levels[level].inverse_size == 0.0 ? 0 : 1;
      for (std::int64_t x = -reach; x <= reach; ++x) {
        for (std::int64_t y = -reach; y <= reach; ++y) {
          table.for_column(level, {c.x + x, c.y + y, c.z - reach},
                           static_cast<std::uint64_t>(2 * reach), test);
        }
      }
    }
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
    const Levels levels = choose_levels(boxes);
    const CellTable table(boxes, levels);
    find_on_own_level(boxes, levels, table, pairs);
    find_on_coarser_levels(boxes, levels, table, pairs);
    sort_pairs(boxes.size(), pairs);
  }
  counters.candidate_pairs += pairs.size();
}

}  // namespace soda::physics
