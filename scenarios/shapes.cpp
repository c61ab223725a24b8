#include "scenarios/shapes.hpp"

#include <algorithm>
#include <cmath>

#include "physics/shapes/compiled_shape.hpp"
#include "scenarios/format.hpp"
#include "scenarios/mesh_file.hpp"
#include "scenarios/orientation.hpp"

namespace soda::scenarios {
namespace {

enum class KeyKind { kSphere, kBox, kCapsule, kCylinder, kHull, kCompound };

double length_of(const Vec3& v) { return std::sqrt(v.x() * v.x() + v.y() * v.y() + v.z() * v.z()); }

// Box around the vertices.
physics::Aabb box_of(const std::vector<Vec3>& vertices) {
  physics::Aabb box{vertices.front(), vertices.front()};
  for (const Vec3& v : vertices) {
    for (int i = 0; i < 3; ++i) {
      box.min[i] = std::min(box.min[i], v[i]);
      box.max[i] = std::max(box.max[i], v[i]);
    }
  }
  return box;
}

std::vector<double> key_of(KeyKind kind, std::initializer_list<double> numbers) {
  std::vector<double> key{static_cast<double>(kind)};
  key.insert(key.end(), numbers);
  return key;
}

struct Adder {
  std::vector<physics::Shape>& shapes;
  ShapeIndex& index;

  const PlacedShape& add(std::vector<double> key, physics::Shape shape, const Vec3& size,
                         double radius, const Vec3& center = Vec3::Zero()) {
    const auto [at, is_new] = index.try_emplace(std::move(key));
    if (is_new) {
      at->second = {.index = static_cast<std::uint32_t>(shapes.size()),
                    .center_m = center,
                    .size_m = size,
                    .bounding_radius_m = radius,
                    .mass = physics::mass_properties(shape, shapes)};
      shapes.push_back(std::move(shape));
    }
    return at->second;
  }

  // Environment has no mass and hardly ever repeats: not looked up.
  PlacedShape add_environment(physics::Shape shape) {
    PlacedShape placed;
    placed.index = static_cast<std::uint32_t>(shapes.size());
    shapes.push_back(std::move(shape));
    return placed;
  }
};

std::optional<PlacedShape> place(const SphereSpec& s, Adder adder, FaultList&) {
  const double d = 2.0 * s.radius_m;
  return adder.add(key_of(KeyKind::kSphere, {s.radius_m}), physics::Sphere{s.radius_m},
                   Vec3(d, d, d), s.radius_m);
}

std::optional<PlacedShape> place(const BoxSpec& s, Adder adder, FaultList&) {
  const Vec3 half(0.5 * s.size_m.x(), 0.5 * s.size_m.y(), 0.5 * s.size_m.z());
  return adder.add(key_of(KeyKind::kBox, {s.size_m.x(), s.size_m.y(), s.size_m.z()}),
                   physics::Box{half}, s.size_m, length_of(half));
}

std::optional<PlacedShape> place(const CapsuleSpec& s, Adder adder, FaultList&) {
  const double d = 2.0 * s.radius_m;
  return adder.add(key_of(KeyKind::kCapsule, {s.radius_m, s.length_m}),
                   physics::Capsule{s.radius_m, s.length_m}, Vec3(d, d, d + s.length_m),
                   s.radius_m + 0.5 * s.length_m);
}

std::optional<PlacedShape> place(const CylinderSpec& s, Adder adder, FaultList&) {
  const double d = 2.0 * s.radius_m;
  return adder.add(key_of(KeyKind::kCylinder, {s.radius_m, s.length_m}),
                   physics::Cylinder{s.radius_m, s.length_m}, Vec3(d, d, s.length_m),
                   length_of(Vec3(s.radius_m, 0.0, 0.5 * s.length_m)));
}

std::optional<PlacedShape> place(const HullSpec& s, Adder adder, FaultList& faults) {
  std::vector<double> key{static_cast<double>(KeyKind::kHull)};
  for (const Vec3& p : s.points_m) key.insert(key.end(), {p.x(), p.y(), p.z()});
  if (const auto known = adder.index.find(key); known != adder.index.end()) return known->second;

  const auto refuse = [&](const std::string& found, const std::string& allowed) {
    add_fault(faults, *find_member(*s.json, "points_m"), {found, allowed, ""});
    return std::nullopt;
  };
  auto made = physics::make_convex_hull(s.points_m);
  if (const auto* why = std::get_if<std::string>(&made)) {
    return refuse("points without a hull: " + *why, "at least four points not in one plane");
  }
  physics::ConvexHull& hull = std::get<physics::ConvexHull>(made);
  const physics::MassProperties mass = physics::mass_properties(physics::Shape(hull));
  const physics::Aabb box = box_of(hull.vertices_m);
  const Vec3 size(box.max.x() - box.min.x(), box.max.y() - box.min.y(), box.max.z() - box.min.z());
  const double least = std::min({size.x(), size.y(), size.z()});
  const double most = std::max({size.x(), size.y(), size.z()});
  // A sliver has no usable inertia: its volume must be a fair part of what its size suggests.
  const bool solid = mass.volume_m3 >= 1e-9 * most * most * most;
  if (least < kMinLength_m || most > kMaxLength_m || !solid) {
    return refuse("a hull of size " + number_text(size.x()) + " x " + number_text(size.y()) +
                      " x " + number_text(size.z()) + " m and volume " +
                      number_text(mass.volume_m3) + " m^3",
                  "a size from 0.0001 to 100000 m and a volume of at least 1e-9 of the longest "
                  "side cubed");
  }
  double radius = 0.0;
  for (Vec3& v : hull.vertices_m) {
    v = Vec3(v.x() - mass.center_local_m.x(), v.y() - mass.center_local_m.y(),
             v.z() - mass.center_local_m.z());
    radius = std::max(radius, length_of(v));
  }
  return adder.add(std::move(key), std::move(hull), size, radius, mass.center_local_m);
}

// Parts in the file's frame become those about this centre.
PlacedShape add_compound(physics::Compound compound, const Vec3& center,
                         const physics::MassProperties& mass, Adder adder) {
  std::vector<double> key{static_cast<double>(KeyKind::kCompound)};
  for (physics::CompoundPart& part : compound.parts) {
    part.position_m = Vec3(part.position_m.x() - center.x(), part.position_m.y() - center.y(),
                           part.position_m.z() - center.z());
    const physics::Quat& q = part.orientation;
    key.insert(key.end(), {static_cast<double>(part.shape), part.position_m.x(),
                           part.position_m.y(), part.position_m.z(), q.w(), q.x(), q.y(), q.z()});
  }
  // Where the parts are tells what the centre is but for its name in the file.
  key.insert(key.end(), {center.x(), center.y(), center.z()});
  if (const auto known = adder.index.find(key); known != adder.index.end()) return known->second;
  const physics::CompiledShape compiled = physics::compile(compound, adder.shapes);
  const physics::Aabb box = physics::tight_aabb(compiled, {});
  const Vec3 size(box.max.x() - box.min.x(), box.max.y() - box.min.y(), box.max.z() - box.min.z());
  PlacedShape placed =
      adder.add(key, std::move(compound), size, compiled.bounding_radius_m, center);
  placed.mass = mass;
  return adder.index[key] = placed;
}

std::optional<PlacedShape> place(const CompoundSpec& s, Adder adder, FaultList& faults) {
  physics::Compound compound;
  for (const PartSpec& part : s.parts) {
    const physics::Quat orientation = orientation_of(part.orientation, faults);
    const std::optional<PlacedShape> placed = std::visit(
        [&](const auto& shape) -> std::optional<PlacedShape> {
          return shape.sound ? place(shape, adder, faults) : std::nullopt;
        },
        part.shape);
    if (!placed) return std::nullopt;
    const Vec3 center = orientation._transformVector(placed->center_m);
    compound.parts.push_back(
        {placed->index,
         Vec3(part.position_m.x() + center.x(), part.position_m.y() + center.y(),
              part.position_m.z() + center.z()),
         orientation});
  }
  physics::MassProperties mass = physics::mass_properties(compound, adder.shapes);
  const Vec3 center = mass.center_local_m;
  mass.center_local_m = Vec3::Zero();
  return add_compound(std::move(compound), center, mass, adder);
}

// The shape about another centre of mass: a compound, if of one part.
std::optional<PlacedShape> recenter(const PlacedShape& shape, const Vec3& center,
                                    const JsonValue& at, Adder adder, FaultList& faults) {
  if (center == shape.center_m) return shape;
  const Vec3 way = center - shape.center_m;
  const physics::CompiledShape compiled = physics::compile(adder.shapes[shape.index], adder.shapes);
  const physics::Aabb box = physics::tight_aabb(compiled, {});
  if ((way - box.min).minCoeff() < 0.0 || (box.max - way).minCoeff() < 0.0) {
    const auto range = [&](int i) {
      return number_text(box.min[i] + shape.center_m[i]) + " to " +
             number_text(box.max[i] + shape.center_m[i]);
    };
    add_fault(
        faults, at,
        {"a centre of mass outside of the shape",
         "a point within it: x from " + range(0) + ", y from " + range(1) + ", z from " + range(2),
         ""});
    return std::nullopt;
  }
  physics::Compound compound;
  if (const auto* parts = std::get_if<physics::Compound>(&adder.shapes[shape.index]))
    compound = *parts;
  else
    compound.parts.push_back({.shape = shape.index});
  for (physics::CompoundPart& part : compound.parts) part.position_m += shape.center_m;
  physics::MassProperties mass = shape.mass;
  mass.center_local_m = Vec3::Zero();
  mass.inertia_per_density_m5 =
      physics::inertia_about(mass.inertia_per_density_m5, mass.volume_m3, way);
  return add_compound(std::move(compound), center, mass, adder);
}

// An index beyond the vertices or a triangle without area; else true.
bool check_triangles(const MeshSpec& s, FaultList& faults) {
  bool good = true;
  const JsonValue* at = find_member(*s.json, "triangles")->first_child;
  for (const IntVec3& t : s.triangles) {
    const auto count = static_cast<std::int64_t>(s.vertices_m.size());
    if (std::max({t[0], t[1], t[2]}) >= count) {
      add_fault(
          faults, *at,
          {"an index beyond the vertices", "indices from 0 to " + std::to_string(count - 1), ""});
      good = false;
    } else {
      const Vec3 &a = s.vertices_m[t[0]], &b = s.vertices_m[t[1]], &c = s.vertices_m[t[2]];
      if (length_of(Vec3(b - a).cross(Vec3(c - a))) == 0.0) {
        add_fault(faults, *at, {"a triangle without area", "three vertices not in one line", ""});
        good = false;
      }
    }
    at = at->next_sibling;
  }
  return good;
}

std::optional<PlacedShape> place_mesh(const MeshSpec& s, const MeshFiles& files, Adder adder,
                                      FaultList& faults) {
  if (s.file) {
    auto read = read_mesh_file(*s.file, s.unit_m, files);
    if (const auto* why = std::get_if<std::string>(&read)) {
      const std::string found = printable(files.path_of(*s.file)) + ": " + printable(*why);
      add_fault(faults, *find_member(*s.json, "file"),
                {found, "a readable .obj or .stl file with triangles", ""});
      return std::nullopt;
    }
    return adder.add_environment(std::move(std::get<physics::TriangleMesh>(read)));
  }
  if (!check_triangles(s, faults)) return std::nullopt;
  physics::TriangleMesh mesh;
  for (const Vec3& v : s.vertices_m) {
    mesh.vertices_m.emplace_back(v.x() * s.unit_m, v.y() * s.unit_m, v.z() * s.unit_m);
  }
  for (const IntVec3& t : s.triangles) {
    mesh.triangles.push_back({static_cast<std::uint32_t>(t[0]), static_cast<std::uint32_t>(t[1]),
                              static_cast<std::uint32_t>(t[2])});
  }
  return adder.add_environment(std::move(mesh));
}

std::optional<PlacedShape> place_halfspace(const HalfSpaceSpec& s, Adder adder, FaultList& faults) {
  const double norm = length_of(s.normal);
  if (norm < 1e-6) {
    add_fault(faults, *find_member(*s.json, "normal"),
              {"a normal of length " + number_text(norm), "a length of at least 1e-6", ""});
    return std::nullopt;
  }
  const Vec3 normal(s.normal.x() / norm, s.normal.y() / norm, s.normal.z() / norm);
  return adder.add_environment(physics::HalfSpace{normal, s.offset_m});
}

}  // namespace

std::optional<PlacedShape> place_shape(const SolidShapeSpec& spec,
                                       std::vector<physics::Shape>& shapes, ShapeIndex& index,
                                       FaultList& faults) {
  return std::visit(
      [&](const auto& s) -> std::optional<PlacedShape> {
        return s.sound ? place(s, Adder{shapes, index}, faults) : std::nullopt;
      },
      spec);
}

std::optional<PlacedShape> place_body_shape(const SolidSpec& spec,
                                            std::vector<physics::Shape>& shapes, ShapeIndex& index,
                                            FaultList& faults) {
  std::optional<PlacedShape> shape = place_shape(spec.shape, shapes, index, faults);
  if (!shape || !spec.center_of_mass_m) return shape;
  return recenter(*shape, *spec.center_of_mass_m, *find_member(*spec.json, "center_of_mass_m"),
                  {shapes, index}, faults);
}

std::optional<PlacedShape> place_shape(const StaticShapeSpec& spec, const MeshFiles& files,
                                       std::vector<physics::Shape>& shapes, ShapeIndex& index,
                                       FaultList& faults) {
  return std::visit(
      [&](const auto& s) -> std::optional<PlacedShape> {
        using S = std::decay_t<decltype(s)>;
        const Adder adder{shapes, index};
        if (!s.sound) return std::nullopt;
        if constexpr (std::is_same_v<S, MeshSpec>)
          return place_mesh(s, files, adder, faults);
        else if constexpr (std::is_same_v<S, HalfSpaceSpec>)
          return place_halfspace(s, adder, faults);
        else
          return place(s, adder, faults);
      },
      spec);
}

}  // namespace soda::scenarios
