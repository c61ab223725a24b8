// How long a search may go on making a failing trial small.
#pragma once

#include <functional>

namespace soda::analysis {

struct ShrinkLimits {
  unsigned trials = 400;
  std::function<bool()> out_of_time = [] { return false; };  // asked before each trial

  bool reached(unsigned tried) const { return tried >= trials || out_of_time(); }
};

}  // namespace soda::analysis
