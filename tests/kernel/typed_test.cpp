// Messages as plain structs: which may be sent, and what of them arrives.
#include "kernel/api/typed.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <limits>
#include <new>
#include <vector>

#include "kernel/api/message.hpp"

namespace soda::kernel {
namespace {

struct Job {
  static constexpr std::uint32_t kKind = 3;
  double service_s = 0.0;
  std::array<float, 2> place_m = {};
};
struct Nested {
  static constexpr std::uint32_t kKind = 4;
  Job job;
  std::uint64_t number = 0;
  bool urgent = false;
  std::uint8_t rest[7] = {};
};
struct GapAtTheEnd {
  [[maybe_unused]] static constexpr std::uint32_t kKind = 5;
  double a = 0.0;
  std::uint32_t b = 0;
};
struct GapBetween {
  float a = 0.0f;
  double b = 0.0;
};
struct GapInside {
  GapBetween inner;
  double b = 0.0;
};
struct LongDouble {
  double a = 0.0, b = 0.0;
  long double c = 0.0L;
};
struct Pointer {
  double a = 0.0;
  const double* b = nullptr;
};
struct Empty {};
struct NoKind {
  double a = 0.0;
};

// Keeps what is sent.
class Sent final : public Outbox {
 public:
  void send(LpId destination, VirtualTime when, std::uint32_t kind, Payload payload) override {
    messages.push_back({{when, destination, kind, 0}, LpId{0}, 1, false, std::move(payload)});
  }
  void fault(Fault) override {}
  MessageView view(std::size_t i) const {
    return {messages[i].source, messages[i].kind, 0, messages[i].payload.bytes()};
  }

  std::vector<Message> messages;
};

template <class T>
bool same_bits(const T& a, const T& b) {
  return std::memcmp(&a, &b, sizeof a) == 0;
}

TEST(TypedMessages, MayHoldFloatingPointNumbersButNoGap) {
  EXPECT_TRUE(TypedMessage<Job>);
  EXPECT_TRUE(TypedMessage<Nested>);
  EXPECT_FALSE(TypedMessage<GapAtTheEnd>);
  EXPECT_FALSE(WithoutPadding<GapBetween>);
  EXPECT_FALSE(WithoutPadding<GapInside>);
  EXPECT_FALSE(WithoutPadding<LongDouble>);
  EXPECT_FALSE(WithoutPadding<Pointer>);
  EXPECT_FALSE(WithoutPadding<Empty>);
  EXPECT_TRUE(WithoutPadding<NoKind>);
  EXPECT_FALSE(TypedMessage<NoKind>);
}

TEST(TypedMessages, AreReadAsTheyWereSentToTheLastBit) {
  const double numbers[] = {0.1, -0.0, std::numeric_limits<double>::infinity(),
                            std::numeric_limits<double>::quiet_NaN(),
                            std::numeric_limits<double>::denorm_min()};
  Sent sent;
  for (const double number : numbers) send(sent, LpId{1}, {2, 0}, Job{number, {1.5f, -0.0f}});
  for (std::size_t i = 0; i < std::size(numbers); ++i) {
    ASSERT_TRUE(is<Job>(sent.view(i)));
    EXPECT_FALSE(is<Nested>(sent.view(i)));
    EXPECT_TRUE(same_bits(read<Job>(sent.view(i)), Job{numbers[i], {1.5f, -0.0f}})) << numbers[i];
  }
}

// Two that are built where other bytes lay before.
TEST(TypedMessages, AreEqualIfTheirMembersHaveTheSameBits) {
  const auto payload_over = [](int before, double service_s) {
    alignas(Nested) std::byte place[sizeof(Nested)];
    std::memset(place, before, sizeof place);
    return Payload::of(*new (place) Nested{{service_s, {1.0f, 2.0f}}, 7, true, {1}});
  };
  EXPECT_EQ(payload_over(0x00, 0.25), payload_over(0xff, 0.25));
  EXPECT_FALSE(payload_over(0x00, 0.25) == payload_over(0x00, 0.5));
  EXPECT_FALSE(payload_over(0x00, 0.0) == payload_over(0x00, -0.0)) << "bits decide";
  const double not_a_number = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(payload_over(0x00, not_a_number), payload_over(0xff, not_a_number));
}

}  // namespace
}  // namespace soda::kernel
