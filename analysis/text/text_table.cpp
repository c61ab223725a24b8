#include "analysis/text/text_table.hpp"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cinttypes>
#include <cstdio>
#include <numeric>

namespace soda::analysis {
namespace {

std::string padded(const std::string& cell, std::size_t width, Align align) {
  const std::string space(width - cell.size(), ' ');
  return align == Align::kLeft ? cell + space : space + cell;
}

std::string format_row(const std::vector<Column>& columns, const std::vector<std::size_t>& widths,
                       const std::vector<std::string>& cells) {
  std::string line;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    line += "  " + padded(cells[i], widths[i], columns[i].align);
  }
  line.erase(line.find_last_not_of(' ') + 1);
  return line + "\n";
}

std::string hex16(std::uint64_t value) {
  char buffer[17];
  std::snprintf(buffer, sizeof buffer, "%016" PRIx64, value);
  return buffer;
}

}  // namespace

std::string format_number(double value, int digits) {
  char buffer[64];
  std::snprintf(buffer, sizeof buffer, "%.*g", digits, value);
  return buffer;
}

std::string format_exact(double value) {
  char buffer[64];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value);
  return std::string(buffer, end.ptr);
}

std::string format_bits(double value) { return "0x" + hex16(std::bit_cast<std::uint64_t>(value)); }

std::string format_digest(std::uint64_t digest) { return hex16(digest); }

std::string format_table(const std::vector<Column>& columns,
                         const std::vector<std::vector<std::string>>& rows) {
  std::vector<std::string> titles;
  std::vector<std::size_t> widths;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    titles.push_back(columns[i].title);
    widths.push_back(columns[i].title.size());
    for (const auto& row : rows) widths[i] = std::max(widths[i], row[i].size());
  }
  std::string text = format_row(columns, widths, titles);
  const std::size_t rule = std::accumulate(widths.begin(), widths.end(), 2 * widths.size() - 2);
  text += "  " + std::string(rule, '-') + "\n";
  for (const auto& row : rows) text += format_row(columns, widths, row);
  return text;
}

}  // namespace soda::analysis
