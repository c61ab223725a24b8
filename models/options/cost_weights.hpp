// What work costs on a virtual processor, piece by piece.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "physics/model/stage_counters.hpp"

namespace soda::models {

// What is measured together, for it comes together (`soda calibrate`).
enum class CostGroup : std::uint8_t {
  kEvents,       // scheduling and handling of an event that does nothing
  kBodies,       // boxes, forces, integration, copies
  kTests,        // pairs, and tests of shapes
  kPoints,       // rows built of contact points, impulses stored
  kSweeps,       // islands, and sweeps over their rows
  kFactors,      // factorisations
  kJoints,       // rows of joints
  kImpacts,      // searches for the time of an impact
  kDivision,     // border tests, records packed and unpacked, samples of load
  kCheckpoints,  // entries of the transform buffer
};
inline constexpr std::size_t kCostGroups = 10;
const char* name_of(CostGroup group);

// Picoseconds, measured on one core of the machine on which soda was written.
struct CostWeights {
  std::int64_t event_ps = 300'000;
  std::int64_t body_ps = 200'000;
  std::int64_t drive_ps = 50'000;
  std::int64_t pair_ps = 40'000;
  std::array<std::int64_t, static_cast<std::size_t>(physics::ShapeKernel::kCount)> test_ps{
      150'000, 600'000, 400'000, 1'500'000, 4'000'000, 4'000'000};  // by physics::ShapeKernel
  std::int64_t contact_point_ps = 300'000;
  std::int64_t island_ps = 500'000;
  std::int64_t row_iteration_ps = 45'000;
  std::int64_t multiplication_ps = 1000;  // of a factorisation
  std::int64_t joint_row_ps = 4'000'000;  // of all factorisations and aims of a step
  std::int64_t impact_search_ps = 2'500'000;
  std::int64_t border_test_ps = 50'000;
  std::int64_t record_ps = 250'000;  // a ghost, contact, record or migrant, encoded or decoded
  std::int64_t sampled_body_ps = 500'000;  // what measuring a load costs (load_sample.hpp)
  std::int64_t stored_entry_ps = 300'000;  // its frame, read and written
  std::int64_t stored_body_ps = 50'000;    // read, compared, packed
  std::int64_t byte_ps = 500;              // sent, or stored
  std::int64_t gvt_ps = 1'000'000;         // a report and an outcome, of a processor
  std::int64_t commit_ps = 100'000;        // handing it on, and collecting what it left
};

// Each weight of a group times its factor; GVT, commits and bytes sent as they are.
CostWeights scaled(const CostWeights& weights, const std::array<double, kCostGroups>& factors);

}  // namespace soda::models
