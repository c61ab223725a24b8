// Families of scenes over a number n: rows, stacks, chains, stars, grids, piles. No n is special,
// so errors and costs of neighbours are alike.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "physics/step/step.hpp"

namespace soda::analysis {

// After a step.
struct FamilyView {
  const physics::SceneDescription& scene;
  std::span<const physics::BodyId> ids;
  std::span<const physics::BodyState> states;
  const physics::StepReport& report;
  std::int64_t step = 0;  // from 1
  bool last = false;
};

struct FamilyScene {
  physics::SceneDescription scene;
  std::vector<physics::BodyState> states;
  std::int64_t steps = 0;
  // One number for each measure of the family; of a run, the largest after any step counts.
  std::function<std::vector<double>(const FamilyView&)> judge;
};

// What is off, and by how much it may be.
struct FamilyMeasure {
  std::string name;     // short, with its unit
  std::string meaning;  // where the name does not say all; may be empty
  double bound = 0.0;   // at any n
  // Errors below are no errors of the method; between them nothing counts as a jump. > 0.
  double floor = 0.0;
  std::string floor_reason;
};

// One curve over n.
struct FamilySeries {
  std::string name;
  std::function<FamilyScene(int)> build;
};

struct Family {
  std::string name;
  std::string scene;                    // how it is built
  std::vector<FamilyMeasure> measures;  // at least one
  std::vector<int> sizes;               // of n, ascending
  std::vector<int> full_sizes;          // those that take long; after `sizes`
  std::vector<FamilySeries> series;
};

// All of them, in a fixed order.
std::vector<Family> all_families();

// By what they are made of. Balls in flight and on a smooth floor.
std::vector<Family> ball_row_families();
// Sliding boxes and plates, stacks, piles.
std::vector<Family> contact_families();
// Hanging and lying chains, stars, grids.
std::vector<Family> joint_families();

}  // namespace soda::analysis
