// Whatever a library leaves in the upper halves of the vector registers, arithmetic pays for: XXH3
// of libxxhash's dispatcher made runs of several worlds take up to twice as long.
#include <gtest/gtest.h>

#include "tests/models/divided_runs.hpp"

#if defined(__x86_64__)
#include <cpuid.h>
#include <immintrin.h>

#include <cstring>
#endif

namespace soda::models {
namespace {

#if defined(__x86_64__)

bool processor_tells() {
  constexpr std::uint32_t kXsave = 1u << 27, kTellsInUse = 1u << 2;
  std::uint32_t a = 0, b = 0, c = 0, d = 0;
  return __builtin_cpu_supports("avx") && __get_cpuid(1, &a, &b, &c, &d) != 0 &&
         (c & kXsave) != 0 && __get_cpuid_count(0xd, 1, &a, &b, &c, &d) != 0 &&
         (a & kTellsInUse) != 0;
}

bool upper_halves_are_in_use() {
  constexpr std::uint32_t kOf256Bits = 1u << 2, kOf512Bits = 1u << 6;
  std::uint32_t low = 0, high = 0;
  __asm__ volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(1));
  return (low & (kOf256Bits | kOf512Bits)) != 0;
}

__attribute__((target("avx"))) void release_upper_halves() { _mm256_zeroupper(); }

// Whether they can be released, and the C library leaves them so.
bool can_be_tested() {
  if (!processor_tells()) return false;
  release_upper_halves();
  std::vector<char> from(4096, 'a'), to(4096);
  std::memmove(to.data(), from.data(), to.size());
  std::memset(from.data(), to[17], from.size());
  return from[5] == 'a' && !upper_halves_are_in_use();
}

#else

bool can_be_tested() { return false; }
bool upper_halves_are_in_use() { return false; }

#endif

TEST(VectorRegisters, UpperHalvesAreNotLeftInUse) {
  if (!can_be_tested()) GTEST_SKIP() << "this machine does not tell what is in use";
  const test::Scene scene = busy_scene(1);
  int steps = 0, in_use = 0;
  const CommitObserver observer{.wants_states = true, .on_step = [&](const CommittedStep& step) {
                                  physics::digest(step.ids, step.states);
                                  ++steps;
                                  in_use += upper_halves_are_in_use();
                                }};
  RunOptions options;
  options.steps = 40;
  const SimulationResult result =
      simulate(scene.description, scene.states, blocks(4), options, observer);
  ASSERT_GT(result.worlds.islands_reused, 0u) << "nothing has been hashed";
  EXPECT_EQ(steps, 40);
  EXPECT_EQ(in_use, 0);
}

}  // namespace
}  // namespace soda::models
