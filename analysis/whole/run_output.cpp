#include "analysis/whole/run_output.hpp"

#include <cstdio>

#include "scenarios/read_json.hpp"

namespace soda::analysis {
namespace {

using scenarios::find_member;
using scenarios::JsonValue;

std::uint64_t count_of(const JsonValue* object, std::string_view key) {
  if (object == nullptr) return 0;
  const JsonValue* const value = find_member(*object, key);
  return value == nullptr ? 0 : static_cast<std::uint64_t>(value->integer);
}

}  // namespace

std::optional<RunOutput> parse_run_output(const std::string& text) {
  scenarios::FaultList faults;
  const scenarios::JsonTree tree = scenarios::parse_json(text, faults);
  if (!faults.empty() || tree.root() == nullptr) return {};
  const JsonValue& root = *tree.root();
  const JsonValue* const digests = find_member(root, "step_digests");
  const JsonValue* const last = find_member(root, "digest");
  if (digests == nullptr || last == nullptr) return {};
  RunOutput output;
  for (const JsonValue* digest = digests->first_child; digest != nullptr;
       digest = digest->next_sibling)
    output.step_digests.emplace_back(digest->text);
  output.digest = last->text;
  const JsonValue* const events = find_member(root, "events");
  output.events = count_of(events, "executed");
  output.rolled_back = count_of(events, "rolled_back");
  output.rollbacks = count_of(events, "rollbacks");
  output.migrations = count_of(find_member(root, "stages"), "migrations");
  return output;
}

std::optional<ToldFault> find_fault(const std::string& text) {
  const std::size_t place = text.find("soda: step ");  // behind warnings, which name steps, too
  if (place == std::string::npos) return {};
  long long step = 0;
  unsigned long long world = 0, body = 0;
  if (std::sscanf(text.c_str() + place, "soda: step %lld, world %llu, body %llu:", &step, &world,
                  &body) != 3)
    return {};
  return ToldFault{step, body};
}

}  // namespace soda::analysis
