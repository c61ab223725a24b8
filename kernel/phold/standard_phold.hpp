// PHOLD as other kernels run it, for measuring speed: exponential delays, almost no handler.
// phold.hpp is the one for tests, with all that a kernel can get wrong.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "kernel/api/hash_mix.hpp"
#include "kernel/api/logical_process.hpp"

namespace soda::kernel {

// Virtual time of PHOLD: ticks of 2^-20 units. The mean delay is one unit.
inline constexpr std::int64_t kTicksPerUnit = std::int64_t{1} << 20;

struct StandardPholdOptions {
  std::uint32_t lps = 1024;               // >= 1
  std::uint32_t start_events_per_lp = 1;  // each LP sends them to itself at (0, 0)
  double remote = 0.25;      // probability of an LP drawn from all, itself included; else itself
  double least_delay = 0.1;  // units, 0 .. 1; a delay is least_delay + Exp(1 - least_delay), but at
                             // least one tick
  // An event goes through this many zero-delay hops before it takes a delay.
  std::uint32_t zero_delay_rounds = 0;
  // Whether the state of an LP depends on the order of what it consumes, or only on what.
  bool order_sensitive = false;
  std::uint64_t seed = 1;
};

// The configurations C1 to C6 that kernels are compared on.
struct PholdConfiguration {
  const char* name;
  StandardPholdOptions model;
  double end_units;
};
std::vector<PholdConfiguration> phold_configurations();

// All that is random about an event: a function of its token.
struct PholdDraw {
  std::uint64_t next_token = 0;
  std::int64_t delay_ticks = 0;  // >= 1
  std::uint32_t destination = 0;
};

class PholdDraws {
 public:
  explicit PholdDraws(const StandardPholdOptions& options);

  std::uint64_t first_token(std::uint32_t lp, std::uint32_t event) const {
    return append(append(seed_, lp), event);
  }

  PholdDraw draw(std::uint64_t token, std::uint32_t lp) const {
    const std::uint64_t where = mix64(token + kStep);
    const std::uint64_t next = mix64(token + 2 * kStep);
    const bool remote = (where & 0xffffffffu) < remote_below_;
    const auto other = static_cast<std::uint32_t>(((where >> 32) * lps_) >> 32);
    return {next, delay_ticks(next), remote ? other : lp};
  }

 private:
  static constexpr std::uint64_t kStep = 0x9e3779b97f4a7c15ull;

  std::int64_t delay_ticks(std::uint64_t word) const;

  std::uint64_t seed_;
  std::uint64_t lps_;
  std::uint64_t remote_below_;  // of 2^32
  double least_ticks_;
  double exponential_ticks_;  // mean of the random part
};

// -log(x / 2^53) for x = 1 .. 2^53, to 1e-10, by operations that IEEE 754 defines to the last bit:
// the logarithm of the C library may differ between machines.
double minus_log_of_fraction(std::uint64_t x);

std::vector<std::unique_ptr<LogicalProcess>> make_standard_phold(
    const StandardPholdOptions& options);

// What has been committed by LPs from make_standard_phold, after a run without a fault.
struct StandardPholdResult {
  std::uint64_t events = 0;  // messages consumed
  std::uint64_t digest = 0;  // of the committed times and last states of all LPs
};
// The same in two steps, for LPs that are not all in one process: of one LP; of all, in order.
struct StandardPholdPart {
  std::uint64_t events = 0, times = 0, state = 0;
};
StandardPholdPart standard_phold_part(const LogicalProcess& lp);
StandardPholdResult join(std::span<const StandardPholdPart> parts);

StandardPholdResult standard_phold_result(std::span<const std::unique_ptr<LogicalProcess>> lps);

}  // namespace soda::kernel
