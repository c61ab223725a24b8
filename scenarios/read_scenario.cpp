#include "scenarios/read_scenario.hpp"

#include "scenarios/build_scenario.hpp"
#include "scenarios/field_table.hpp"
#include "scenarios/file_text.hpp"
#include "scenarios/format.hpp"
#include "scenarios/read_json.hpp"

namespace soda::scenarios {
namespace {

constexpr std::size_t kMaxFileBytes = std::size_t{256} << 20;

}  // namespace

Scenario read_scenario_text(std::string_view text, const std::string& file,
                            std::optional<std::uint64_t> seed, const MeshFiles& files,
                            ScenarioExtent extent) {
  FaultList faults;
  const JsonTree tree = parse_json(text, faults);
  Scenario scenario;
  if (const JsonValue* root = tree.root()) {
    DocumentSpec document;
    read_object(document_table(), *root, &document, faults);
    if (root->kind == JsonKind::kObject)
      scenario = build_scenario(document, file, {seed, extent}, files, faults);
  }
  if (!faults.empty()) {
    sort_by_place(faults);
    throw InputError(file, std::move(faults));
  }
  return scenario;
}

std::string read_text(const std::string& file) {
  FileText text = read_file_text(file, kMaxFileBytes);
  if (!text.failure.empty()) throw FileError(file + ": cannot be read: " + text.failure);
  if (text.bytes.size() > kMaxFileBytes) {
    InputFault fault;
    fault.found = "more than 256 MiB";
    fault.allowed = "at most 256 MiB";
    throw InputError(file, {fault});
  }
  return std::move(text.bytes);
}

Scenario read_scenario_file(const std::string& file, std::optional<std::uint64_t> seed) {
  return read_scenario_text(read_text(file), file, seed);
}

}  // namespace soda::scenarios
