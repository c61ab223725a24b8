// Collecting the faults of a file.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "scenarios/json_tree.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::scenarios {

// Faults beyond this many are not collected; a message lists the first kListedFaults.
inline constexpr std::size_t kMaxFaults = 1000;
inline constexpr std::size_t kListedFaults = 100;

using FaultList = std::vector<InputFault>;

// What is wrong, in the words of InputFault.
struct FaultText {
  std::string found, allowed, hint;
};

// Adds a fault at the value's place (or at its key's); drops it if there are kMaxFaults already.
void add_fault(FaultList& faults, const JsonValue& at, FaultText text);
void add_fault_at_key(FaultList& faults, const JsonValue& at, FaultText text);

// Orders by place, keeping the order of detection at one place.
void sort_by_place(FaultList& faults);

// `did you mean "x"?` for the known name that was probably meant, or "". A name is near if it needs
// few edits, or if it is the word followed by a unit (`mass` for `mass_kg`).
std::string nearest_name_hint(std::string_view word, std::span<const std::string_view> known);

// "12:5 (/bodies/3)", to name a second place in a fault.
std::string place_of(const JsonValue& value);

// `"a", "b" or "c"`.
std::string list_names(std::span<const std::string_view> names);

// Shortest decimal text that reads back as the same double.
std::string number_text(double value);

}  // namespace soda::scenarios
