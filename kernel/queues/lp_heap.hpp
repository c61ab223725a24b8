// The LPs of one worker, the one with the earliest floor on top.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "kernel/api/virtual_time.hpp"

namespace soda::kernel {

// A 4-ary heap over the numbers 0 .. size() - 1, each with a time that can be changed in
// O(log size). Equal times: the lower number comes first. Keys are inline, for the sake of the
// cache.
class LpHeap {
 public:
  explicit LpHeap(std::size_t size, VirtualTime time = kBeginning) : positions_(size) {
    keys_.reserve(size);
    for (std::uint32_t lp = 0; lp < size; ++lp) {
      keys_.push_back({time, lp});
      positions_[lp] = lp;
    }
  }

  bool empty() const { return keys_.empty(); }
  std::size_t size() const { return keys_.size(); }
  std::uint32_t top() const { return keys_.front().second; }
  VirtualTime top_time() const { return empty() ? kNever : keys_.front().first; }
  VirtualTime time_of(std::uint32_t lp) const { return keys_[positions_[lp]].first; }

  void update(std::uint32_t lp, VirtualTime time) {
    const std::size_t at = positions_[lp];
    if (time == keys_[at].first) return;
    const bool earlier = time < keys_[at].first;
    keys_[at].first = time;
    if (earlier)
      sift_up(at);
    else
      sift_down(at);
  }

 private:
  using Key = std::pair<VirtualTime, std::uint32_t>;

  void put(std::size_t at, const Key& key) {
    keys_[at] = key;
    positions_[key.second] = static_cast<std::uint32_t>(at);
  }

  void sift_up(std::size_t at) {
    const Key key = keys_[at];
    for (std::size_t parent; at > 0 && key < keys_[parent = (at - 1) / 4]; at = parent)
      put(at, keys_[parent]);
    put(at, key);
  }

  void sift_down(std::size_t at) {
    const Key key = keys_[at];
    while (true) {
      const std::size_t first = 4 * at + 1;
      std::size_t least = first;
      for (std::size_t child = first + 1; child < first + 4 && child < keys_.size(); ++child)
        if (keys_[child] < keys_[least]) least = child;
      if (least >= keys_.size() || !(keys_[least] < key)) break;
      put(at, keys_[least]);
      at = least;
    }
    put(at, key);
  }

  std::vector<Key> keys_;
  std::vector<std::uint32_t> positions_;  // of each number in keys_
};

}  // namespace soda::kernel
