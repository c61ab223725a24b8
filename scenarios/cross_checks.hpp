// Checks that look at more than one place of a document.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string_view>
#include <vector>

#include "scenarios/document.hpp"
#include "scenarios/faults.hpp"

namespace soda::scenarios {

using MaterialIndex = std::map<std::string_view, physics::Material, std::less<>>;

// By name; a name given twice is a fault.
MaterialIndex index_materials(const std::vector<MaterialSpec>& materials, FaultList& faults);

// The material called `name` by the member "material" of `user`, or null. An unknown name is a
// fault, unless the member itself was faulty (and the name therefore empty).
const physics::Material* find_material(const MaterialIndex& materials, std::string_view name,
                                       const JsonValue& user, FaultList& faults);

// Index into SceneDescription::drives by name.
using DriveIndex = std::map<std::string_view, std::uint32_t, std::less<>>;

// Appends every drive to `drives`; a name given twice is a fault, and so are way points that lie on
// top of each other as seen along gravity.
DriveIndex index_drives(const DocumentSpec& document, std::vector<physics::Drive>& drives,
                        FaultList& faults);

// The drive that `body` names: kNoDrive if it names none. Nothing, and a fault, if there is no such
// drive.
std::optional<std::uint32_t> find_drive(const DriveIndex& drives, const SolidSpec& body,
                                        FaultList& faults);

// The filter of each collision group that a body or a static is in, by name. A fault: more than 64
// groups, or an ignored collision of a group that nothing is in.
using GroupIndex = std::map<std::string_view, physics::CollisionFilter, std::less<>>;
GroupIndex index_groups(const DocumentSpec& document, FaultList& faults);

// The place of the body that the user knows by this id.
std::optional<std::uint32_t> find_body(const physics::SceneDescription& scene, std::int64_t label);

// Ids and counts of bodies and generators: unique, within range, not too many.
void check_ids(const DocumentSpec& document, FaultList& faults);
void check_static_names(const std::vector<StaticSpec>& statics, FaultList& faults);
void check_territory(const TerritorySpec& territory, FaultList& faults);

// A time that `member` gives, in steps; a fault if it is no whole number of them, with the hint
// `instead`.
std::int64_t whole_steps(double time_s, double time_step_s, const JsonValue& member,
                         const char* instead, FaultList& faults);

// Steps of the run; 0 if there is none that is allowed.
std::int64_t steps_of(const DocumentSpec& document, FaultList& faults);

}  // namespace soda::scenarios
