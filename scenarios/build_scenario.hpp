// From the document to the scenario: look-ups, cross-checks, shapes, masses, generated bodies.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "scenarios/document.hpp"
#include "scenarios/faults.hpp"
#include "scenarios/mesh_file.hpp"
#include "scenarios/scenario.hpp"

namespace soda::scenarios {

struct BuildOptions {
  std::optional<std::uint64_t> seed;  // replaces every seed
  ScenarioExtent extent = ScenarioExtent::kAll;
};

// What the fields of the document do not say by themselves is checked here; a part with a fault is
// left out, so that the faults of the others still come to light. The result is whole only if
// `faults` is empty. `file` gives the name, and the folder of mesh files.
Scenario build_scenario(const DocumentSpec& document, const std::string& file,
                        const BuildOptions& options, MeshFiles files, FaultList& faults);

}  // namespace soda::scenarios
