#include "kernel/api/invariant.hpp"

#include <cstdio>
#include <cstdlib>

namespace soda::kernel {

void fail_invariant(const char* what, const std::string& values, const char* file, int line) {
  std::fprintf(stderr, "soda: broken invariant at %s:%d: %s: %s\n", file, line, what,
               values.c_str());
  std::abort();
}

}  // namespace soda::kernel
