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

// Takes its values by copy: whose address is taken must lie in memory, also where nothing fails.
template <class... Values>
[[noreturn, gnu::cold, gnu::noinline]] void fail_with(const char* what,
                                                      const std::source_location& where,
                                                      Values... values) {
  fail_invariant(what, describe(values...), where);
}

}  // namespace soda::kernel

// SODA_ASSERT(condition, values...): the values, streamed one after the other, are evaluated only
// if the condition is false. Take one that names the LP and the virtual time.
#define SODA_ASSERT(condition, ...)                                                        \
  do {                                                                                     \
    if (!(condition)) [[unlikely]]                                                         \
      ::soda::kernel::fail_with(#condition, std::source_location::current(), __VA_ARGS__); \
  } while (false)
