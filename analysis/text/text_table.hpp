// Plain-text output: numbers and tables.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace soda::analysis {

// `digits` significant digits, in the form of printf's %g.
std::string format_number(double value, int digits = 4);
// Shortest decimal that reads back as the same bits.
std::string format_exact(double value);
// "0x" and 16 digits: the bits of the double.
std::string format_bits(double value);
// 16 hexadecimal digits.
std::string format_digest(std::uint64_t digest);

enum class Align { kLeft, kRight };

struct Column {
  std::string title;
  Align align = Align::kLeft;
};

// Columns are as wide as their widest cell, two spaces apart, each line indented by two.
std::string format_table(const std::vector<Column>& columns,
                         const std::vector<std::vector<std::string>>& rows);

}  // namespace soda::analysis
