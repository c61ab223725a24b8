#include "scenarios/warnings.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <tuple>
#include <utility>

namespace soda::scenarios {
namespace {

using Check = void (*)(const Written& written, WarningList& warnings);
constexpr Check kChecks[] = {check_overlaps,   check_floors,  check_anchors,
                             check_joint_cost, check_meshes,  check_domain,
                             check_time,       check_gravity, check_motion};

}  // namespace

std::string warning_text(const std::string& file, const InputWarning& warning) {
  std::string text = file + ":" + std::to_string(warning.line) + ":" +
                     std::to_string(warning.column) + ": " +
                     (warning.pointer.empty() ? "document" : warning.pointer) + ": warning " +
                     warning.kind + ": found " + warning.found + "; likely: " + warning.likely;
  if (warning.more > 0) text += "; and " + std::to_string(warning.more) + " more of this kind";
  return text;
}

void WarningList::add(std::string_view kind, const JsonValue& at,
                      const std::function<WarningText()>& text) {
  if (++count_[kind] > kListedWarnings) return;
  WarningText words = text();
  told_.push_back({.kind = std::string(kind),
                   .line = at.place.line,
                   .column = at.place.column,
                   .pointer = pointer_to(at),
                   .found = std::move(words.found),
                   .likely = std::move(words.likely)});
}

std::vector<InputWarning> WarningList::take() {
  std::ranges::stable_sort(told_, {},
                           [](const InputWarning& w) { return std::tie(w.line, w.column); });
  for (std::size_t i = told_.size(); i-- > 0;) {
    InputWarning& warning = told_[i];
    std::size_t& count = count_[warning.kind];
    if (count > kListedWarnings) warning.more = count - kListedWarnings;
    count = 0;
  }
  count_.clear();
  return std::exchange(told_, {});
}

std::string about(double value) {
  char digits[32];
  std::snprintf(digits, sizeof digits, "%.4g", value);
  return number_text(std::strtod(digits, nullptr));
}

bool Written::is_absent(physics::BodyId id) const {
  return std::ranges::binary_search(scenario.run.inputs.absent, id);
}

std::string Written::name_of(physics::BodyId id) const {
  return "body " + std::to_string(scenario.scene.bodies[physics::index_of(id)].label);
}

std::vector<InputWarning> find_warnings(const Written& written) {
  WarningList warnings;
  for (const Check check : kChecks) check(written, warnings);
  return warnings.take();
}

}  // namespace soda::scenarios
