// A program that needs a Time Warp kernel and no physics.
#include <cstdio>

#include "kernel/api/executor.hpp"
#include "kernel/phold/phold.hpp"

int main() {
  const auto lps = soda::kernel::make_phold({.lps = 8});
  const auto run = soda::kernel::run_threads(lps, {100, 0}, {.threads = 2, .window = 10});
  std::printf("%016llx\n", static_cast<unsigned long long>(soda::kernel::phold_digest(lps)));
  return run.counters.committed > 0 ? 0 : 1;
}
