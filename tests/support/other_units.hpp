// A scenario's text in other units, and so other numbers for the same scene.
#pragma once

#include <string>
#include <string_view>

namespace soda::test {

// Each is what the numbers of that dimension are multiplied by.
struct Units {
  double mass = 1.0, length = 1.0, time = 1.0;
};

// Every number is multiplied as the unit says in which its key ends ("velocity_m_s"); what has no
// unit stays. Powers of two change no digit of a number.
std::string in_other_units(std::string_view scenario, const Units& units);

}  // namespace soda::test
