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

// A name that nothing has: `what` in its member `key` of `user`.
void add_unknown_name(std::string_view name, std::string_view key, std::string_view what,
                      std::vector<std::string_view> known, const JsonValue& user,
                      FaultList& faults) {
  const JsonValue& member = *find_member(user, key);
  const std::string hint = nearest_name_hint(name, known);
  known.resize(std::min<std::size_t>(known.size(), 10));
  const std::string allowed = "the name of a " + std::string(what);
  add_fault(faults, member,
            {describe(member),
             known.empty() ? allowed + " (there are none)"
                           : allowed + ", such as " + printable(list_names(known)),
             hint});
}

void add_name_again(const JsonValue& name, std::string_view what, const JsonValue& first,
                    FaultList& faults) {
  add_fault(faults, name,
            {describe(name) + " again", "each " + std::string(what) + " name once",
             "first at " + place_of(first)});
}

template <class Index>
std::vector<std::string_view> names_in(const Index& index) {
  std::vector<std::string_view> names;
  names.reserve(index.size());
  for (const auto& [name, value] : index) names.push_back(name);
  return names;
}

// As seen along gravity, which is how a lane is seen.
double level_distance_m(const Vec3& a, const Vec3& b, const Vec3& gravity) {
  const Vec3 way = b - a;
  const double squared = gravity.squaredNorm();
  if (squared == 0.0) return way.norm();
  return Vec3(way - gravity * (gravity.dot(way) / squared)).norm();
}

void check_way_points(const DriveSpec& drive, const Vec3& gravity, FaultList& faults) {
  if (!drive.sound || drive.way_points_m.empty()) return;
  const JsonValue* point = find_member(*drive.json, "way_points_m")->first_child;
  for (std::size_t i = 1; i < drive.way_points_m.size(); ++i) {
    point = point->next_sibling;
    const double way = level_distance_m(drive.way_points_m[i - 1], drive.way_points_m[i], gravity);
    if (way >= kMinLength_m) continue;
    add_fault(faults, *point,
              {"a way point " + number_text(way) + " m from the one before, as seen along gravity",
               "at least " + number_text(kMinLength_m) + " m", ""});
  }
}

physics::Drive drive_of(const DriveSpec& spec) {
  physics::Drive drive;
  drive.time_constant_s = spec.time_constant_s;
  drive.max_acceleration_m_s2 = spec.max_acceleration_m_s2;
  drive.velocity_m_s = spec.velocity_m_s.value_or(Vec3::Zero());
  if (!spec.way_points_m.empty()) {
    drive.lane = physics::Lane{.way_points_m = spec.way_points_m,
                               .half_width_m = spec.half_width_m.value_or(1.0),
                               .speed_m_s = spec.speed_m_s.value_or(0.0)};
  }
  return drive;
}

}  // namespace

MaterialIndex index_materials(const std::vector<MaterialSpec>& materials, FaultList& faults) {
  MaterialIndex index;
  std::map<std::string_view, const MaterialSpec*> first;
  for (const MaterialSpec& m : materials) {
    if (m.name.empty()) continue;
    const auto [at, is_new] = first.try_emplace(m.name, &m);
    index.try_emplace(m.name, physics::Material{m.friction, m.restitution, m.rolling_friction_m,
                                                m.torsional_friction_m});
    if (is_new) continue;
    add_name_again(*find_member(*m.json, "name"), "material",
                   *find_member(*at->second->json, "name"), faults);
  }
  return index;
}

const physics::Material* find_material(const MaterialIndex& materials, std::string_view name,
                                       const JsonValue& user, FaultList& faults) {
  if (name.empty()) return nullptr;
  const auto at = materials.find(name);
  if (at != materials.end()) return &at->second;
  add_unknown_name(name, "material", "material", names_in(materials), user, faults);
  return nullptr;
}

DriveIndex index_drives(const DocumentSpec& document, std::vector<physics::Drive>& drives,
                        FaultList& faults) {
  DriveIndex index;
  std::map<std::string_view, const DriveSpec*> first;
  for (const DriveSpec& drive : document.drives) {
    if (drive.name.empty()) continue;
    const auto [at, is_new] = first.try_emplace(drive.name, &drive);
    if (!is_new) {
      add_name_again(*find_member(*drive.json, "name"), "drive",
                     *find_member(*at->second->json, "name"), faults);
    }
    check_way_points(drive, document.gravity_m_s2, faults);
    index.try_emplace(drive.name, static_cast<std::uint32_t>(drives.size()));
    drives.push_back(drive_of(drive));
  }
  return index;
}

GroupIndex index_groups(const DocumentSpec& document, FaultList& faults) {
  constexpr std::size_t kMostGroups = 64;
  GroupIndex index;
  const auto enter = [&](const std::optional<std::string>& group, const JsonValue* user) {
    if (!group || user == nullptr || index.contains(*group)) return;
    const std::size_t bit = index.size();
    if (bit == kMostGroups)
      add_fault(faults, *find_member(*user, "collision_group"),
                {"collision group number 65, \"" + *group + "\"", "at most 64 groups", ""});
    index[*group].groups = bit < kMostGroups ? std::uint64_t{1} << bit : 0;
  };
  for (const BodySpec& body : document.bodies) enter(body.collision_group, body.json);
  for (const GeneratorSpec& generator : document.generators)
    std::visit([&](const auto& g) { enter(g.collision_group, g.json); }, generator);
  for (const StaticSpec& spec : document.statics) enter(spec.collision_group, spec.json);
  for (const IgnoredCollisionSpec& ignored : document.ignored_collisions) {
    if (!ignored.sound) continue;
    const auto group = index.find(ignored.group), with = index.find(ignored.with);
    if (group == index.end())
      add_unknown_name(ignored.group, "group", "collision group", names_in(index), *ignored.json,
                       faults);
    if (with == index.end())
      add_unknown_name(ignored.with, "with", "collision group", names_in(index), *ignored.json,
                       faults);
    if (group != index.end() && with != index.end())
      group->second.ignored_groups |= with->second.groups;
  }
  return index;
}

std::optional<std::uint32_t> find_body(const physics::SceneDescription& scene, std::int64_t label) {
  const auto place = std::lower_bound(scene.bodies.begin(), scene.bodies.end(), label,
                                      [](const physics::BodyParams& body, std::int64_t wanted) {
                                        return std::int64_t{body.label} < wanted;
                                      });
  if (place == scene.bodies.end() || place->label != label) return std::nullopt;
  return static_cast<std::uint32_t>(place - scene.bodies.begin());
}

std::optional<std::uint32_t> find_drive(const DriveIndex& drives, const SolidSpec& body,
                                        FaultList& faults) {
  if (!body.drive) return physics::kNoDrive;
  const auto at = drives.find(*body.drive);
  if (at != drives.end()) return at->second;
  add_unknown_name(*body.drive, "drive", "drive", names_in(drives), *body.json, faults);
  return std::nullopt;
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

std::int64_t whole_steps(double time_s, double time_step_s, const JsonValue& member,
                         const char* instead, FaultList& faults) {
  const double quotient = time_s / time_step_s;
  const double whole = std::floor(quotient + 0.5);
  if (whole > 1e9) {
    add_fault(faults, member, {number_text(whole) + " steps", "at most 1000000000 steps", ""});
    return 0;
  }
  if (std::abs(quotient - whole) > 1e-9 * std::max(1.0, whole)) {
    add_fault(faults, member,
              {describe(member) + " = " + number_text(quotient) + " steps",
               "a whole number of steps of " + number_text(time_step_s) + " s", instead});
  }
  return static_cast<std::int64_t>(whole);
}

std::int64_t steps_of(const DocumentSpec& document, FaultList& faults) {
  if (document.steps) return *document.steps;
  if (!document.duration_s || document.time_step_s <= 0.0) return 0;
  return whole_steps(*document.duration_s, document.time_step_s,
                     *find_member(*document.json, "duration_s"), "give steps instead", faults);
}

}  // namespace soda::scenarios
