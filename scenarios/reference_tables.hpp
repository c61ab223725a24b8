// The tables of what is known of a run beforehand.
#pragma once

#include "scenarios/document.hpp"
#include "scenarios/field_table.hpp"

namespace soda::scenarios {

extern const ChoiceTable kReference;

// Every measure of error, by its key in the file, in the order of reports.
struct MeasureKey {
  std::string_view key;
  std::optional<double> BoundsSpec::*bound;
};
std::span<const MeasureKey> measure_keys();

}  // namespace soda::scenarios
