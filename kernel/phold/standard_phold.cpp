#include "kernel/phold/standard_phold.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

#include "kernel/api/invariant.hpp"
#include "kernel/time_warp/copy_history.hpp"

namespace soda::kernel {
namespace {

constexpr std::uint32_t kStandardEvent = 0;

struct StandardPayload {
  std::uint64_t token;
  std::uint64_t hops_left;  // zero-delay hops
};
static_assert(sizeof(StandardPayload) <= Payload::kInlineBytes);

struct State {
  std::uint64_t digest = 0;
  std::uint64_t consumed = 0;
  std::uint64_t started = 0;  // 0 or 1
};

class StandardPholdProcess final : public SmallProcess<State> {
 public:
  StandardPholdProcess(LpId id, const StandardPholdOptions& options,
                       std::shared_ptr<const PholdDraws> draws)
      : id_(id),
        order_sensitive_(options.order_sensitive),
        hops_(options.zero_delay_rounds),
        start_events_(options.start_events_per_lp),
        draws_(std::move(draws)) {}

  VirtualTime next_time() const override {
    return state_.started != 0 ? kNever : VirtualTime{0, 0};
  }

  void execute(VirtualTime now, std::span<const MessageView> bag, Outbox& outbox) override {
    if (state_.started == 0) start(outbox);
    for (const MessageView& message : bag) consume(now, message, outbox);
  }

  void commit(VirtualTime now) override {
    const auto word = static_cast<std::uint64_t>(now.t) ^ (std::uint64_t{now.round} << 44);
    committed_times_ = (std::rotl(committed_times_, 5) ^ word) * 0x9e3779b97f4a7c15ull;
  }
  std::uint64_t digest() const override { return append(state_.digest, state_.consumed); }

  std::uint64_t consumed() const { return state_.consumed; }
  std::uint64_t committed_times() const { return committed_times_; }

 private:
  void start(Outbox& outbox) {
    state_.started = 1;
    for (std::uint32_t i = 0; i < start_events_; ++i) {
      const std::uint64_t token = draws_->first_token(index_of(id_), i);
      outbox.send(id_, {draws_->draw(token, 0).delay_ticks, 0}, kStandardEvent,
                  Payload::of(StandardPayload{token, hops_}));
    }
  }

  void consume(VirtualTime now, const MessageView& message, Outbox& outbox) {
    StandardPayload event;
    SODA_ASSERT(message.payload.size() == sizeof event, message.payload.size(), " bytes");
    std::memcpy(&event, message.payload.data(), sizeof event);
    ++state_.consumed;
    if (order_sensitive_)
      state_.digest = append(state_.digest, event.token + index_of(message.source));
    else
      state_.digest += event.token;
    const PholdDraw draw = draws_->draw(event.token, index_of(id_));
    VirtualTime when{now.t + draw.delay_ticks, 0};
    StandardPayload next{draw.next_token, hops_};
    if (event.hops_left > 0) {
      when = {now.t, now.round + 1};
      next.hops_left = event.hops_left - 1;
    }
    outbox.send(LpId{draw.destination}, when, kStandardEvent, Payload::of(next));
  }

  const LpId id_;
  const bool order_sensitive_;
  const std::uint32_t hops_;
  const std::uint32_t start_events_;
  const std::shared_ptr<const PholdDraws> draws_;
  std::uint64_t committed_times_ = 0;
};

}  // namespace

std::vector<PholdConfiguration> phold_configurations() {
  return {{"C1", {.lps = 1024}, 1000.0},
          {"C2", {.lps = 1024, .start_events_per_lp = 16}, 100.0},
          {"C3", {.lps = 1024, .start_events_per_lp = 16, .remote = 1.0}, 100.0},
          {"C4", {.lps = 65536, .start_events_per_lp = 16}, 4.0},
          {"C5", {.lps = 1024, .least_delay = 0.0}, 1000.0},
          {"C6", {.lps = 16}, 20000.0}};
}

PholdDraws::PholdDraws(const StandardPholdOptions& options)
    : seed_(options.seed),
      lps_(options.lps),
      remote_below_(static_cast<std::uint64_t>(options.remote * 0x1p32)),
      least_ticks_(options.least_delay * static_cast<double>(kTicksPerUnit)),
      exponential_ticks_((1.0 - options.least_delay) * static_cast<double>(kTicksPerUnit)) {}

std::int64_t PholdDraws::delay_ticks(std::uint64_t word) const {
  const double ticks = least_ticks_ + exponential_ticks_ * minus_log_of_fraction((word >> 11) + 1);
  return std::max<std::int64_t>(1, static_cast<std::int64_t>(ticks));
}

// x = m 2^e with m in [sqrt(1/2), sqrt(2)), log m = 2 atanh(s), s = (m - 1) / (m + 1), |s| < 0.172.
// The series of atanh is cut off where its next term is below 2e-11.
double minus_log_of_fraction(std::uint64_t x) {
  constexpr double kLog2 = 0x1.62e42fefa39efp-1;
  constexpr std::uint64_t kMantissa = (std::uint64_t{1} << 52) - 1;
  // Bits of sqrt(2) after the leading one: from there on, m is halved.
  constexpr std::uint64_t kSqrt2Mantissa = 0x6a09e667f3bcd;
  const auto bits = std::bit_cast<std::uint64_t>(static_cast<double>(x));
  const bool halve = (bits & kMantissa) >= kSqrt2Mantissa;
  const std::int64_t exponent = static_cast<std::int64_t>(bits >> 52) - 1023 + halve;
  const auto m = std::bit_cast<double>((bits & kMantissa) | (std::uint64_t{1023} - halve) << 52);
  const double s = (m - 1.0) / (m + 1.0);
  const double s2 = s * s;
  const double s4 = s2 * s2;
  // In pairs (Estrin), for everything else waits for the delay.
  const double series =
      (1.0 + s2 * (1.0 / 3)) + s4 * ((1.0 / 5 + s2 * (1.0 / 7)) + s4 * (1.0 / 9 + s2 * (1.0 / 11)));
  return static_cast<double>(53 - exponent) * kLog2 - 2.0 * s * series;
}

std::vector<std::unique_ptr<LogicalProcess>> make_standard_phold(
    const StandardPholdOptions& options) {
  SODA_ASSERT(options.lps >= 1 && options.remote >= 0 && options.remote <= 1 &&
                  options.least_delay >= 0 && options.least_delay <= 1,
              "lps ", options.lps, ", remote ", options.remote, ", least delay ",
              options.least_delay);
  std::vector<std::unique_ptr<LogicalProcess>> lps;
  lps.reserve(options.lps);
  const auto draws = std::make_shared<const PholdDraws>(options);
  for (std::uint32_t i = 0; i < options.lps; ++i)
    lps.push_back(std::make_unique<StandardPholdProcess>(LpId{i}, options, draws));
  return lps;
}

StandardPholdPart standard_phold_part(const LogicalProcess& lp) {
  const auto& process = static_cast<const StandardPholdProcess&>(lp);
  return {process.consumed(), process.committed_times(), process.digest()};
}

StandardPholdResult join(std::span<const StandardPholdPart> parts) {
  StandardPholdResult result;
  for (const StandardPholdPart& part : parts) {
    result.events += part.events;
    result.digest = append(append(result.digest, part.times), part.state);
  }
  return result;
}

StandardPholdResult standard_phold_result(std::span<const std::unique_ptr<LogicalProcess>> lps) {
  std::vector<StandardPholdPart> parts;
  for (const auto& lp : lps) parts.push_back(standard_phold_part(*lp));
  return join(parts);
}

}  // namespace soda::kernel
