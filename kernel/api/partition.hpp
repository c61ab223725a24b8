// Which worker, or virtual processor, owns which LP.
#pragma once

#include <cstddef>

#include "kernel/api/virtual_time.hpp"

namespace soda::kernel {

// Contiguous ranges of nearly equal length; with fewer LPs than workers, some have none.
struct Partition {
  std::size_t lps = 0;
  std::size_t workers = 1;

  std::size_t owner_of(LpId lp) const { return index_of(lp) * workers / lps; }
  std::size_t first_of(std::size_t worker) const { return (worker * lps + workers - 1) / workers; }
};

}  // namespace soda::kernel
