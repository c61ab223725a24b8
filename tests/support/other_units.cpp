#include "tests/support/other_units.hpp"

#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace soda::test {
namespace {

struct Dimension {
  std::string_view suffix;
  int mass, length, time;
};

// The first that fits: the longest.
constexpr std::array kDimensions{Dimension{"stiffness_newton_m", 1, 0, -2},
                                 Dimension{"_newton_s_m", 1, 0, -1},
                                 Dimension{"_newton_s", 1, 1, -1},
                                 Dimension{"_newton_m", 1, 2, -2},
                                 Dimension{"_newton", 1, 1, -2},
                                 Dimension{"_kg_m3", 1, -3, 0},
                                 Dimension{"_kg_m2", 1, 2, 0},
                                 Dimension{"_kg", 1, 0, 0},
                                 Dimension{"_m_s2", 0, 1, -2},
                                 Dimension{"_m_s", 0, 1, -1},
                                 Dimension{"_rad_s", 0, 0, -1},
                                 Dimension{"_1_s", 0, 0, -1},
                                 Dimension{"_s", 0, 0, 1},
                                 Dimension{"_m", 0, 1, 0}};

double factor_of(std::string_view key, const Units& units) {
  for (const auto& [suffix, mass, length, time] : kDimensions)
    if (key.ends_with(suffix))
      return std::pow(units.mass, mass) * std::pow(units.length, length) *
             std::pow(units.time, time);
  return 1.0;
}

}  // namespace

std::string in_other_units(std::string_view scenario, const Units& units) {
  std::string out;
  double factor = 1.0;
  for (std::size_t i = 0; i < scenario.size();) {
    if (scenario[i] == '"') {
      const std::size_t end = scenario.find('"', i + 1);  // no scene escapes quotes
      if (scenario.find_first_not_of(" \n", end + 1) == scenario.find(':', end + 1))
        factor = factor_of(scenario.substr(i + 1, end - i - 1), units);
      out += scenario.substr(i, end + 1 - i);
      i = end + 1;
    } else if (scenario[i] == '-' || std::isdigit(static_cast<unsigned char>(scenario[i]))) {
      char* end = nullptr;
      const std::string rest(scenario.substr(i, 40));
      const double value = std::strtod(rest.c_str(), &end);
      const std::size_t length = static_cast<std::size_t>(end - rest.c_str());
      std::array<char, 40> text{};
      std::snprintf(text.data(), text.size(), "%.17g", factor * value);
      out += factor == 1.0 ? rest.substr(0, length) : std::string(text.data());
      i += length;
    } else {
      out += scenario[i++];
    }
  }
  return out;
}

}  // namespace soda::test
