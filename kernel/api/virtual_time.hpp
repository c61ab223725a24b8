// Virtual time: the integer, totally ordered clock of a simulation.
#pragma once

#include <compare>
#include <cstdint>
#include <limits>
#include <ostream>

namespace soda::kernel {

// A point of virtual time, ordered lexicographically. `t` is the model's coarse clock (for SODA the
// physics step, for PHOLD a tick); `round` orders what happens within one `t` (superdense time), so
// that every effect comes strictly after its cause even where no coarse time passes. Integers only:
// a sum of floating-point delays would depend on the path that led there.
struct VirtualTime {
  std::int64_t t = 0;
  std::uint32_t round = 0;

  friend constexpr auto operator<=>(const VirtualTime&, const VirtualTime&) = default;

  // What the above gives, in fewer instructions: compilers make a number of the order first.
  [[gnu::always_inline]] friend constexpr bool operator==(VirtualTime a, VirtualTime b) {
    return a.t == b.t && a.round == b.round;
  }
  [[gnu::always_inline]] friend constexpr bool operator<(VirtualTime a, VirtualTime b) {
    return a.t < b.t || (a.t == b.t && a.round < b.round);
  }
  [[gnu::always_inline]] friend constexpr bool operator>(VirtualTime a, VirtualTime b) {
    return b < a;
  }
  [[gnu::always_inline]] friend constexpr bool operator<=(VirtualTime a, VirtualTime b) {
    return !(b < a);
  }
  [[gnu::always_inline]] friend constexpr bool operator>=(VirtualTime a, VirtualTime b) {
    return !(a < b);
  }
};

// Later than every time a model can use: "nothing to do", and the GVT of a finished run.
inline constexpr VirtualTime kNever{std::numeric_limits<std::int64_t>::max(),
                                    std::numeric_limits<std::uint32_t>::max()};

// Earlier than every time a model can use: "from the very beginning".
inline constexpr VirtualTime kBeginning{std::numeric_limits<std::int64_t>::min(), 0};

// As "(t, round)", for messages to people.
inline std::ostream& operator<<(std::ostream& out, const VirtualTime& time) {
  return out << '(' << time.t << ", " << time.round << ')';
}

// Index of a logical process, 0 .. number of processes - 1.
enum class LpId : std::uint32_t {};

constexpr std::uint32_t index_of(LpId id) { return static_cast<std::uint32_t>(id); }

}  // namespace soda::kernel
