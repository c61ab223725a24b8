// Assertions that stay on in every build: a broken invariant must not become a wrong trajectory.
#pragma once

#include <source_location>
#include <sstream>
#include <string>

namespace soda::kernel {

// Prints what broke, with the values, to stderr and aborts.
[[noreturn]] void fail_invariant(const char* what, const std::string& values,
                                 const std::source_location& where);

template <class... Values>
std::string describe(const Values&... values) {
  std::ostringstream text;
  (text << ... << values);
  return text.str();
}

}  // namespace soda::kernel

// SODA_ASSERT(condition, values...): the values, streamed one after the other, are evaluated only
// if the condition is false. Take one that names the LP and the virtual time.
#define SODA_ASSERT(condition, ...)                                                     \
  do {                                                                                  \
    if (!(condition)) [[unlikely]]                                                      \
      ::soda::kernel::fail_invariant(#condition, ::soda::kernel::describe(__VA_ARGS__), \
                                     std::source_location::current());                  \
  } while (false)
