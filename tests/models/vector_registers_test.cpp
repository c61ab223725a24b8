// Whatever a library leaves in the upper halves of the vector registers, arithmetic pays for: XXH3
// of libxxhash's dispatcher made runs of several worlds take up to twice as long.
#include <gtest/gtest.h>

#include "tests/models/divided_runs.hpp"

#if defined(__x86_64__)
#include <cpuid.h>
#endif

namespace soda::models {
namespace {

#if defined(__x86_64__)

// Which parts of the processor's state are in use; 0 if it does not tell.
std::uint64_t state_in_use() {
  constexpr std::uint32_t kXsave = 1u << 27, kTellsInUse = 1u << 2;
  std::uint32_t a = 0, b = 0, c = 0, d = 0;
  if (__get_cpuid(1, &a, &b, &c, &d) == 0 || (c & kXsave) == 0) return 0;
  if (__get_cpuid_count(0xd, 1, &a, &b, &c, &d) == 0 || (a & kTellsInUse) == 0) return 0;
  __asm__ volatile("xgetbv" : "=a"(a), "=d"(d) : "c"(1));
  return a | std::uint64_t{d} << 32;
}

#else

std::uint64_t state_in_use() { return 0; }

#endif

TEST(VectorRegisters, UpperHalvesAreNotLeftInUse) {
  constexpr std::uint64_t kUpperHalves = 1u << 2 | 1u << 6;  // of 256 and of 512 bits
  if (state_in_use() == 0) GTEST_SKIP() << "the processor does not tell what is in use";
  const test::Scene scene = busy_scene(1);
  int steps = 0, in_use = 0;
  const CommitObserver observer{.wants_states = true, .on_step = [&](const CommittedStep& step) {
                                  physics::digest(step.ids, step.states);
                                  ++steps;
                                  in_use += (state_in_use() & kUpperHalves) != 0;
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
