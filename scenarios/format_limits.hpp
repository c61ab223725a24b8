// Ranges that several tables of the format use.
#pragma once

#include "scenarios/field_table.hpp"
#include "scenarios/format.hpp"

namespace soda::scenarios {

inline constexpr bool kRequired = true, kOptional = false;

inline constexpr Limits kLength{kMinLength_m, kMaxLength_m};
inline constexpr Limits kPosition{-kMaxPosition_m, kMaxPosition_m};
inline constexpr Limits kSpeed{-1e6, 1e6};
inline constexpr Limits kGap{-1e5, 1e5};
inline constexpr Limits kSeed{0.0, 9007199254740992.0};  // 2^53: exact in every JSON tool
inline constexpr Limits kCount{1.0, static_cast<double>(kMaxBodies)};
inline constexpr Limits kId{0.0, static_cast<double>(kMaxBodyId)};
inline constexpr Limits kNone{};
inline constexpr Limits kLabel{.min_items = 1, .max_items = 200};
inline constexpr Limits kText{.min_items = 0, .max_items = 10'000};
inline constexpr Limits kUnitInterval{0.0, 1.0};
inline constexpr double kMostTurn_rad = 3.0;  // of the half turn after which an angle is not known

constexpr Limits list_of(std::size_t least, std::size_t most, double min = 0.0, double max = 0.0) {
  return {.min = min, .max = max, .min_items = least, .max_items = most};
}

}  // namespace soda::scenarios
