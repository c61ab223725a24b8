// Mixing 64-bit words: counter-based random numbers and order-sensitive digests.
#pragma once

#include <cstdint>

namespace soda::kernel {

// A bijection of 64 bits whose output bits all depend on all input bits: the finalizer of
// SplitMix64 (Steele, Lea, Flood, OOPSLA 2014).
constexpr std::uint64_t mix64(std::uint64_t word) {
  word ^= word >> 30;
  word *= 0xbf58476d1ce4e5b9ull;
  word ^= word >> 27;
  word *= 0x94d049bb133111ebull;
  return word ^ (word >> 31);
}

// Appends a word to a digest; depends on the order of appending.
constexpr std::uint64_t append(std::uint64_t digest, std::uint64_t word) {
  return mix64(digest * 0x9e3779b97f4a7c15ull + mix64(word + 0x9e3779b97f4a7c15ull));
}

// SplitMix64 as a generator. For scheduling decisions only, never for what reaches a state: there,
// draws must be functions of (seed, LP, event).
class SplitMix64 {
 public:
  explicit constexpr SplitMix64(std::uint64_t seed) : counter_(seed) {}
  constexpr std::uint64_t next() { return mix64(counter_ += 0x9e3779b97f4a7c15ull); }
  // Uniform over 0 .. bound - 1 up to a bias of bound / 2^64; bound >= 1.
  constexpr std::uint64_t below(std::uint64_t bound) { return next() % bound; }

 private:
  std::uint64_t counter_;
};

}  // namespace soda::kernel
