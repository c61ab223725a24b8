// Looking for what a scenario without faults hardly means.
#pragma once

#include <functional>
#include <map>
#include <span>
#include <string_view>
#include <vector>

#include "scenarios/document.hpp"
#include "scenarios/faults.hpp"
#include "scenarios/placed_boxes.hpp"
#include "scenarios/scenario.hpp"

namespace soda::scenarios {

// Of each kind this many are told; the others are counted.
inline constexpr std::size_t kListedWarnings = 3;

struct WarningText {
  std::string found, likely;
};

class WarningList {
 public:
  // At the value's place. The text is asked for only if it is among those that are told.
  void add(std::string_view kind, const JsonValue& at, const std::function<WarningText()>& text);
  bool has(std::string_view kind) const { return count_.contains(kind); }
  // By place; the last told of a kind says how many more there are. Empties the list.
  std::vector<InputWarning> take();

 private:
  std::vector<InputWarning> told_;
  std::map<std::string_view, std::size_t> count_;  // by kind
};

// What the checks look at: the file and what has become of it. `places`: by body, where it stands,
// or the generator that made it.
struct Written {
  const DocumentSpec& document;
  const Scenario& scenario;
  std::span<const JsonValue* const> places;
  const PlacedBoxes& boxes;

  bool is_absent(physics::BodyId id) const;  // at the start
  // `body 7`, which needs no more where the place is its own.
  std::string name_of(physics::BodyId id) const;
};

// A computed figure, to four digits.
std::string about(double value);

// All of them, of a scenario without faults. Takes n log n for n bodies.
std::vector<InputWarning> find_warnings(const Written& written);

// The checks, by file. Bounds stand in docs/scenarios.md, "Warnings".
void check_overlaps(const Written& written, WarningList& warnings);
void check_floors(const Written& written, WarningList& warnings);
void check_anchors(const Written& written, WarningList& warnings);
void check_joint_cost(const Written& written, WarningList& warnings);
void check_meshes(const Written& written, WarningList& warnings);
void check_domain(const Written& written, WarningList& warnings);
void check_time(const Written& written, WarningList& warnings);
void check_gravity(const Written& written, WarningList& warnings);
void check_motion(const Written& written, WarningList& warnings);

}  // namespace soda::scenarios
