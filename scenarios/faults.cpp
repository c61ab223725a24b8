#include "scenarios/faults.hpp"

#include <algorithm>
#include <charconv>
#include <tuple>

namespace soda::scenarios {
namespace {

std::string line_of(const std::string& file, const InputFault& fault) {
  std::string line = file + ":";
  if (fault.line > 0) {
    line += std::to_string(fault.line) + ":" + std::to_string(fault.column) + ":";
  }
  line += " " + (fault.pointer.empty() ? std::string("document") : fault.pointer);
  line += ": found " + fault.found + "; allowed: " + fault.allowed;
  if (!fault.hint.empty()) line += " (" + fault.hint + ")";
  return line;
}

std::string message_of(const std::string& file, const std::vector<InputFault>& faults) {
  std::string message;
  const std::size_t listed = std::min(faults.size(), kListedFaults);
  for (std::size_t i = 0; i < listed; ++i) {
    if (i > 0) message += '\n';
    message += line_of(file, faults[i]);
  }
  if (faults.size() > listed) {
    message += "\n" + file + ": and " + (faults.size() >= kMaxFaults ? "at least " : "") +
               std::to_string(faults.size() - listed) + " more";
  }
  return message;
}

void add(FaultList& faults, TextPlace place, const JsonValue& at, FaultText text) {
  if (faults.size() >= kMaxFaults) return;
  faults.push_back({.line = place.line,
                    .column = place.column,
                    .pointer = pointer_to(at),
                    .found = std::move(text.found),
                    .allowed = std::move(text.allowed),
                    .hint = std::move(text.hint)});
}

// Edits (insert, delete, replace, swap neighbours) that turn a into b.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1), above(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) above[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replace = above[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      row[j] = std::min({above[j] + 1, row[j - 1] + 1, replace});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) row[j] = std::min(row[j], before[j - 2] + 1);
    }
    std::swap(before, above);
    std::swap(above, row);
  }
  return above[b.size()];
}

}  // namespace

InputError::InputError(const std::string& file, std::vector<InputFault> faults)
    : std::runtime_error(message_of(file, faults)), faults_(std::move(faults)) {}

void add_fault(FaultList& faults, const JsonValue& at, FaultText text) {
  add(faults, at.place, at, std::move(text));
}

void add_fault_at_key(FaultList& faults, const JsonValue& at, FaultText text) {
  add(faults, at.key_place, at, std::move(text));
}

void sort_by_place(FaultList& faults) {
  std::stable_sort(faults.begin(), faults.end(), [](const InputFault& a, const InputFault& b) {
    return std::tie(a.line, a.column) < std::tie(b.line, b.column);
  });
}

std::string nearest_name_hint(std::string_view word, std::span<const std::string_view> known) {
  if (word.empty() || word.size() > 60) return "";
  std::string_view best;
  std::size_t best_distance = word.size();
  for (const std::string_view name : known) {
    const bool unit_missing = name.size() > word.size() && name.substr(0, word.size()) == word &&
                              name[word.size()] == '_';
    const std::size_t distance = unit_missing ? 1 : edit_distance(word, name);
    if (distance > std::max<std::size_t>(1, std::max(word.size(), name.size()) / 3)) continue;
    if (distance < best_distance) {
      best = name;
      best_distance = distance;
    }
  }
  return best.empty() ? "" : "did you mean \"" + printable(best) + "\"?";
}

std::string place_of(const JsonValue& value) {
  const std::string pointer = pointer_to(value);
  return std::to_string(value.place.line) + ":" + std::to_string(value.place.column) + " (" +
         (pointer.empty() ? "document" : pointer) + ")";
}

std::string list_names(std::span<const std::string_view> names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (i > 0) text += i + 1 == names.size() ? " or " : ", ";
    text += json_quoted(names[i]);
  }
  return text;
}

std::string number_text(double value) {
  char buffer[32];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value).ptr;
  std::string text(buffer, end);
  // 1e+09 and 1e-06 as people write them.
  if (const std::size_t e = text.find('e'); e != std::string::npos) {
    if (text[e + 1] == '+') text.erase(e + 1, 1);
    const std::size_t digits = e + 1 + (text[e + 1] == '-' ? 1 : 0);
    while (text[digits] == '0') text.erase(digits, 1);
  }
  return text;
}

}  // namespace soda::scenarios
