// Work in a process of its own: what aborts, hangs or runs out of memory must not end a search.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <type_traits>

namespace soda::analysis {

// What the child hands back, as it comes; what it wrote before it died is not lost.
class ChildResults {
 public:
  explicit ChildResults(int file) : file_(file) {}

  template <class T>
  void write(const T& object) {
    static_assert(std::is_trivially_copyable_v<T>);
    write_bytes(reinterpret_cast<const char*>(&object), sizeof object);
  }

 private:
  void write_bytes(const char* bytes, std::size_t count);
  int file_;
};

struct ChildOutcome {
  bool failed = false;
  std::string what;   // what the work threw, or the process wrote to standard error before it died
  std::string bytes;  // of its results
};

// What ends a child, at least 1 s each. The first is the one for work that goes on and on: on a
// busy machine it leaves it as much as on an idle one.
struct ChildLimits {
  unsigned cpu_s = 60;     // processor time, of all its threads together
  unsigned wall_s = 3600;  // for one that waits for what does not come
};

// Runs `work` in a forked child, within the limits, and waits for it. To be called from a program
// with one thread. Throws CheckFailed if no process can be made.
ChildOutcome run_in_child(const std::function<void(ChildResults&)>& work,
                          const ChildLimits& limits = {});

}  // namespace soda::analysis
