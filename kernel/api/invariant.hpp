// Assertions that stay on in every build: a broken invariant must not become a wrong trajectory.
#pragma once

#include <sstream>
#include <string>

namespace soda::kernel {

// Prints what broke, with the values, to stderr and aborts.
[[noreturn]] void fail_invariant(const char* what, const std::string& values, const char* file,
                                 int line);

template <class... Values>
std::string describe(const Values&... values) {
  std::ostringstream text;
  (text << ... << values);
  return text.str();
}

// Takes its values by copy: whose address is taken must lie in memory, also where nothing fails.
template <class... Values>
[[noreturn, gnu::cold, gnu::noinline]] void fail_with(const char* what, const char* file, int line,
                                                      Values... values) {
  fail_invariant(what, describe(values...), file, line);
}

}  // namespace soda::kernel

// SODA_ASSERT(condition, values...): the values, streamed one after the other, are evaluated only
// if the condition is false. Take one that names the LP and the virtual time.
#define SODA_ASSERT(condition, ...)                                           \
  do {                                                                        \
    if (!(condition)) [[unlikely]]                                            \
      ::soda::kernel::fail_with(#condition, __FILE__, __LINE__, __VA_ARGS__); \
  } while (false)
