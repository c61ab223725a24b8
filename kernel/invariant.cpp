#include "kernel/invariant.hpp"

#include <cstdio>
#include <cstdlib>

namespace soda::kernel {

void fail_invariant(const char* what, const std::string& values,
                    const std::source_location& where) {
  std::fprintf(stderr, "soda: broken invariant at %s:%u: %s: %s\n", where.file_name(),
               static_cast<unsigned>(where.line()), what, values.c_str());
  std::abort();
}

}  // namespace soda::kernel
