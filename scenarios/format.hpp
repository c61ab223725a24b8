// The tables of format version 1.
#pragma once

#include "scenarios/field_table.hpp"

namespace soda::scenarios {

inline constexpr std::int64_t kFormatVersion = 1;
inline constexpr std::size_t kMaxBodies = 1'000'000;   // generated ones included
inline constexpr std::int64_t kMaxCells = 10'000'000;  // of the territory grid
inline constexpr double kMaxPosition_m = 1e9;          // in each component, at the start
inline constexpr std::int64_t kMaxSteps = 1'000'000'000;
inline constexpr std::int64_t kMaxBufferEntries = 1'000'000;
inline constexpr std::int64_t kMaxBalancingInterval = 1'000'000;  // steps
inline constexpr std::int64_t kMaxBodyId = 0x7fffffff;
inline constexpr double kMinLength_m = 1e-4, kMaxLength_m = 1e5;
inline constexpr double kMinMass_kg = 1e-12, kMaxMass_kg = 1e12;

// The whole file; everything else hangs from it.
const ObjectTable& document_table();

}  // namespace soda::scenarios
