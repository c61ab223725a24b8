#include "models/islands/solve_share.hpp"

#include <xxhash.h>

#include <cstring>

namespace soda::models {
namespace {

std::array<std::uint64_t, 2> key_of(std::span<const std::byte> input) {
  const XXH128_hash_t hash = XXH3_128bits(input.data(), input.size());
  return {hash.high64, hash.low64};
}

bool equal(std::span<const std::byte> x, std::span<const std::byte> y) {
  return x.size() == y.size() && std::memcmp(x.data(), y.data(), x.size()) == 0;
}

}  // namespace

// The whole input is compared: a hash collision may cost a solve, never a bit.
std::shared_ptr<const SolvedIsland> SolveShare::find(std::span<const std::byte> input) const {
  const Key key = key_of(input);
  const std::lock_guard lock(mutex_);
  const auto entry = entries_.find(key);
  if (entry == entries_.end() || !equal(entry->second.input, input)) return nullptr;
  return entry->second.solved;
}

// Null if another input has the same key. What is too old is dropped.
SolveShare::Entry* SolveShare::entry_for(std::int64_t step, std::span<const std::byte> input) {
  const Key key = key_of(input);
  const auto [place, is_new] = entries_.try_emplace(key);
  if (!is_new) return equal(place->second.input, input) ? &place->second : nullptr;
  by_step_.emplace(step, key);
  const std::int64_t newest = by_step_.rbegin()->first;
  while (by_step_.begin()->first < newest - keep_steps_) {
    entries_.erase(by_step_.begin()->second);
    by_step_.erase(by_step_.begin());
  }
  const auto kept = entries_.find(key);
  if (kept == entries_.end()) return nullptr;
  kept->second.input.assign(input.begin(), input.end());
  return &kept->second;
}

void SolveShare::store(std::int64_t step, kernel::Bytes input,
                       std::shared_ptr<const SolvedIsland> solved) {
  const std::lock_guard lock(mutex_);
  Entry* const entry = entry_for(step, input);
  if (entry != nullptr && !entry->solved) entry->solved = std::move(solved);
}

std::shared_ptr<const SolvedBlocks> SolveShare::find_blocks(std::span<const std::byte> input,
                                                            Range range) const {
  const Key key = key_of(input);
  const std::lock_guard lock(mutex_);
  const auto entry = entries_.find(key);
  if (entry == entries_.end() || !equal(entry->second.input, input)) return nullptr;
  const auto blocks = entry->second.blocks.find(range);
  return blocks == entry->second.blocks.end() ? nullptr : blocks->second;
}

void SolveShare::store_blocks(std::int64_t step, std::span<const std::byte> input, Range range,
                              std::shared_ptr<const SolvedBlocks> solved) {
  const std::lock_guard lock(mutex_);
  Entry* const entry = entry_for(step, input);
  if (entry != nullptr) entry->blocks[range] = std::move(solved);
}

}  // namespace soda::models
