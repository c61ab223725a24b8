#include "scenarios/cross_checks.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "scenarios/format.hpp"
#include "scenarios/generators.hpp"

namespace soda::scenarios {
namespace {

// Ids that an entry of the document takes.
struct IdRange {
  std::int64_t first = 0, last = 0;
  const JsonValue* at = nullptr;
};

std::string text_of(const IdRange& range) {
  const std::string first = std::to_string(range.first);
  return range.first == range.last ? "id " + first
                                   : "ids " + first + " to " + std::to_string(range.last);
}

const SolidSpec& base_of(const GeneratorSpec& spec) {
  return std::visit([](const auto& s) -> const SolidSpec& { return s; }, spec);
}

std::int64_t first_id_of(const GeneratorSpec& spec) {
  return std::visit([](const auto& s) { return s.first_id; }, spec);
}

// The member that says how many there are.
const JsonValue& count_member(const JsonValue& generator) {
  const JsonValue* rows = find_member(generator, "rows");
  return rows ? *rows : *find_member(generator, "count");
}

std::vector<IdRange> id_ranges(const DocumentSpec& document, FaultList& faults) {
  std::vector<IdRange> ranges;
  for (const BodySpec& body : document.bodies) {
    if (body.json && body.id >= 0) {
      ranges.push_back({body.id, body.id, find_member(*body.json, "id")});
    }
  }
  auto total = static_cast<std::int64_t>(document.bodies.size());
  for (const GeneratorSpec& generator : document.generators) {
    const SolidSpec& base = base_of(generator);
    if (!base.sound) continue;
    const std::int64_t count = count_of(generator), first = first_id_of(generator);
    const JsonValue& at = count_member(*base.json);
    const auto most = static_cast<std::int64_t>(kMaxBodies);
    if (count > most || total + count > most) {
      add_fault(faults, at,
                {std::to_string(count) + " bodies after " + std::to_string(total),
                 "at most " + std::to_string(most) + " bodies in all", ""});
      continue;
    }
    total += count;
    const JsonValue* first_member = find_member(*base.json, "first_id");
    if (first + count - 1 > kMaxBodyId) {
      add_fault(faults, *first_member,
                {text_of({first, first + count - 1, nullptr}),
                 "ids up to " + std::to_string(kMaxBodyId), ""});
      continue;
    }
    ranges.push_back({first, first + count - 1, first_member});
  }
  return ranges;
}

}  // namespace

MaterialIndex index_materials(const std::vector<MaterialSpec>& materials, FaultList& faults) {
  MaterialIndex index;
  std::map<std::string_view, const MaterialSpec*> first;
  for (const MaterialSpec& m : materials) {
    if (m.name.empty()) continue;
    const auto [at, is_new] = first.try_emplace(m.name, &m);
    index.try_emplace(m.name, physics::Material{m.friction, m.restitution});
    if (is_new) continue;
    const JsonValue& name = *find_member(*m.json, "name");
    add_fault(faults, name,
              {describe(name) + " again", "each material name once",
               "first at " + place_of(*find_member(*at->second->json, "name"))});
  }
  return index;
}

const physics::Material* find_material(const MaterialIndex& materials, std::string_view name,
                                       const JsonValue& user, FaultList& faults) {
  if (name.empty()) return nullptr;
  const auto at = materials.find(name);
  if (at != materials.end()) return &at->second;
  std::vector<std::string_view> known;
  for (const auto& [material_name, material] : materials) known.push_back(material_name);
  const JsonValue& member = *find_member(user, "material");
  const std::string hint = nearest_name_hint(name, known);
  known.resize(std::min<std::size_t>(known.size(), 10));
  add_fault(faults, member,
            {describe(member),
             known.empty() ? "the name of a material (there are none)"
                           : "the name of a material, such as " + printable(list_names(known)),
             hint});
  return nullptr;
}

void check_ids(const DocumentSpec& document, FaultList& faults) {
  std::vector<IdRange> ranges = id_ranges(document, faults);
  const auto key = [](const IdRange& r) {
    return std::make_tuple(r.first, r.at->place.line, r.at->place.column);
  };
  std::sort(ranges.begin(), ranges.end(),
            [&](const IdRange& a, const IdRange& b) { return key(a) < key(b); });
  // The range that reaches furthest among those before is the one that is overlapped, if any is.
  for (std::size_t i = 1, reaching = 0; i < ranges.size(); ++i) {
    if (ranges[i].first <= ranges[reaching].last) {
      const JsonValue& a = *ranges[reaching].at;
      const JsonValue& b = *ranges[i].at;
      const bool a_later =
          std::tie(a.place.line, a.place.column) > std::tie(b.place.line, b.place.column);
      const IdRange& later = a_later ? ranges[reaching] : ranges[i];
      const IdRange& earlier = a_later ? ranges[i] : ranges[reaching];
      add_fault(faults, *later.at,
                {text_of(later), "ids that no other body has",
                 text_of(earlier) + " at " + place_of(*earlier.at)});
    }
    if (ranges[i].last > ranges[reaching].last) reaching = i;
  }
}

void check_static_names(const std::vector<StaticSpec>& statics, FaultList& faults) {
  std::map<std::string_view, const JsonValue*> first;
  for (const StaticSpec& s : statics) {
    if (s.name.empty()) continue;
    const JsonValue* name = find_member(*s.json, "name");
    const auto [at, is_new] = first.try_emplace(s.name, name);
    if (is_new) continue;
    add_fault(faults, *name,
              {describe(*name) + " again", "each name of a static once",
               "first at " + place_of(*at->second)});
  }
}

void check_territory(const TerritorySpec& territory, FaultList& faults) {
  if (!territory.sound) return;
  const auto& n = territory.cells;
  // Each factor is at most 1e7: the first product cannot overflow, and is cut before the second.
  const std::int64_t layer = n[0] * n[1];
  if (layer > kMaxCells || layer * n[2] > kMaxCells) {
    add_fault(faults, *find_member(*territory.json, "cells"),
              {"more cells than " + std::to_string(kMaxCells),
               "at most " + std::to_string(kMaxCells) + " cells", ""});
    return;
  }
  if (territory.worlds > layer * n[2]) {
    add_fault(faults, *find_member(*territory.json, "worlds"),
              {std::to_string(territory.worlds) + " worlds for " + std::to_string(layer * n[2]) +
                   " cells",
               "at most one world a cell", ""});
  }
}

std::int64_t steps_of(const DocumentSpec& document, FaultList& faults) {
  if (document.steps) return *document.steps;
  if (!document.duration_s || document.time_step_s <= 0.0) return 0;
  const double quotient = *document.duration_s / document.time_step_s;
  const double whole = std::floor(quotient + 0.5);
  const JsonValue& member = *find_member(*document.json, "duration_s");
  if (whole > 1e9) {
    add_fault(faults, member, {number_text(whole) + " steps", "at most 1000000000 steps", ""});
    return 0;
  }
  if (std::abs(quotient - whole) > 1e-9 * std::max(1.0, whole)) {
    add_fault(faults, member,
              {describe(member) + " = " + number_text(quotient) + " steps",
               "a whole number of steps of " + number_text(document.time_step_s) + " s",
               "give steps instead"});
  }
  return static_cast<std::int64_t>(whole);
}

}  // namespace soda::scenarios
