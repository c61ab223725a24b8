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

// Runs `work` in a forked child, for 60 s at most, and waits for it. To be called from a program
// with one thread. Throws CheckFailed if no process can be made.
ChildOutcome run_in_child(const std::function<void(ChildResults&)>& work);

}  // namespace soda::analysis
