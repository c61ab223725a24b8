#include "models/solve_share.hpp"

#include <xxhash.h>

#include <algorithm>

namespace soda::models {
namespace {

std::array<std::uint64_t, 2> key_of(std::span<const std::byte> input) {
  const XXH128_hash_t hash = XXH3_128bits(input.data(), input.size());
  return {hash.high64, hash.low64};
}

}  // namespace

// The whole input is compared: a hash collision may cost a solve, never a bit.
std::shared_ptr<const SolvedIsland> SolveShare::find(std::span<const std::byte> input) const {
  const Key key = key_of(input);
  const std::lock_guard lock(mutex_);
  const auto entry = entries_.find(key);
  if (entry == entries_.end() || !std::ranges::equal(entry->second.input, input)) return nullptr;
  return entry->second.solved;
}

void SolveShare::store(std::int64_t step, kernel::Bytes input,
                       std::shared_ptr<const SolvedIsland> solved) {
  const Key key = key_of(input);
  const std::lock_guard lock(mutex_);
  if (!entries_.try_emplace(key, Entry{std::move(input), std::move(solved)}).second) return;
  by_step_.emplace(step, key);
  const std::int64_t newest = by_step_.rbegin()->first;
  while (by_step_.begin()->first < newest - keep_steps_) {
    entries_.erase(by_step_.begin()->second);
    by_step_.erase(by_step_.begin());
  }
}

}  // namespace soda::models
