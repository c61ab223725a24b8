// Meshes of another unit, or with triangles the wrong way round.
#include <algorithm>
#include <array>

#include "physics/queries/ray_cast.hpp"
#include "scenarios/warnings.hpp"

namespace soda::scenarios {
namespace {

using physics::Aabb;
using physics::TriangleMesh;

// A mesh of this many times all bodies' extent, or of one in so many of the smallest body.
constexpr double kTooLarge = 500.0, kTooSmall = 100.0;

// An edge of a triangle, as it goes round.
struct Edge {
  std::uint32_t low = 0, high = 0;
  bool upwards = false;  // from low to high
  std::uint32_t triangle = 0;
  auto key() const { return std::array{low, high}; }
};

// By vertex, the first one in the same place: who writes triangles one by one repeats corners.
std::vector<std::uint32_t> welded(const TriangleMesh& mesh) {
  std::vector<std::uint32_t> order(mesh.vertices_m.size()), first(order.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  const auto place = [&mesh](std::uint32_t i) {
    const Vec3& v = mesh.vertices_m[i];
    return std::array{v.x(), v.y(), v.z()};
  };
  std::ranges::stable_sort(order, {}, place);
  for (std::size_t i = 0; i < order.size(); ++i)
    first[order[i]] =
        i > 0 && place(order[i - 1]) == place(order[i]) ? first[order[i - 1]] : order[i];
  return first;
}

std::vector<Edge> edges_of(const TriangleMesh& mesh) {
  const std::vector<std::uint32_t> vertex = welded(mesh);
  std::vector<Edge> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t from = vertex[mesh.triangles[t][i]];
      const std::uint32_t to = vertex[mesh.triangles[t][(i + 1) % 3]];
      edges.push_back({std::min(from, to), std::max(from, to), from < to, t});
    }
  std::ranges::stable_sort(edges, {}, &Edge::key);
  return edges;
}

// What the edges say of a mesh. Where more than two triangles meet, nothing can be said.
struct Sides {
  bool closed = true;           // each edge has two triangles
  std::size_t disagreeing = 0;  // edges whose two triangles face opposite sides
  std::uint32_t first = 0;      // the later triangle of the first such edge
};

Sides sides_of(const TriangleMesh& mesh) {
  const std::vector<Edge> edges = edges_of(mesh);
  Sides sides;
  for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    while (end < edges.size() && edges[end].key() == edges[begin].key()) ++end;
    sides.closed = sides.closed && end - begin == 2;
    if (end - begin != 2 || edges[begin].upwards != edges[begin + 1].upwards) continue;
    const std::uint32_t later = edges[begin + 1].triangle;
    sides.first = sides.disagreeing++ == 0 ? later : std::min(sides.first, later);
  }
  return sides;
}

// Six times the volume that the triangles enclose.
double volume_of(const TriangleMesh& mesh) {
  double volume = 0.0;
  const Vec3& origin = mesh.vertices_m.front();
  for (const auto& t : mesh.triangles) {
    const Vec3 a = mesh.vertices_m[t[0]] - origin, b = mesh.vertices_m[t[1]] - origin,
               c = mesh.vertices_m[t[2]] - origin;
    volume += a.dot(b.cross(c));
  }
  return volume;
}

std::string name_of(const StaticSpec& spec) { return "mesh " + json_quoted(printable(spec.name)); }

// The bodies that are there, and what they may be about.
struct Around {
  std::optional<Aabb> all;
  double smallest_m = 0.0;  // longest edge of the smallest body's box
};

Around around(const Written& written) {
  Around found;
  for (std::uint32_t i = 0; i < written.boxes.bodies.size(); ++i) {
    if (written.is_absent(physics::BodyId{i})) continue;
    const Aabb& box = written.boxes.bodies[i];
    const double size = longest_edge_m(box);
    found.smallest_m = found.all ? std::min(found.smallest_m, size) : size;
    found.all = found.all ? joined(*found.all, box) : box;
  }
  return found;
}

void check_unit(const StaticSpec& spec, double size_m, const Around& bodies,
                WarningList& warnings) {
  const double space = longest_edge_m(*bodies.all);
  const bool large = size_m > kTooLarge * space, small = kTooSmall * size_m < bodies.smallest_m;
  if (!large && !small) return;
  warnings.add("mesh-unit", *find_member(*spec.json, "shape"), [&] {
    const std::string found =
        large ? " m long among bodies within " + about(space) + " m"
              : " m long among bodies of at least " + about(bodies.smallest_m) + " m";
    return WarningText{name_of(spec) + ", " + about(size_m) + found,
                       large ? "\"unit_m\": 0.001, if the mesh is in millimetres"
                             : "another unit_m: 1, if the mesh is in metres"};
  });
}

bool starts_inside(const Written& written, const Aabb& box) {
  for (const Aabb& body : written.boxes.bodies)
    if (models::contains(box, body)) return true;
  return false;
}

// A triangle that a ray meets.
struct Met {
  double distance_m = 0.0;
  bool from_behind = false;
};

// The first of them; in the mesh's frame, `down` a unit vector.
std::optional<Met> first_met(const TriangleMesh& mesh, const Vec3& from, const Vec3& down) {
  std::optional<Met> first;
  for (const auto& t : mesh.triangles) {
    const Vec3& corner = mesh.vertices_m[t[0]];
    const Vec3 u = mesh.vertices_m[t[1]] - corner, v = mesh.vertices_m[t[2]] - corner;
    const Vec3 face = u.cross(v), apart = from - corner, across = apart.cross(down);
    const double steep = -face.dot(down);
    const double at_u = v.dot(across) / steep, at_v = -u.dot(across) / steep;
    const double distance = face.dot(apart) / steep;
    if (!(at_u >= 0.0 && at_v >= 0.0 && at_u + at_v <= 1.0 && distance >= 0.0)) continue;
    if (!first || distance < first->distance_m) first = Met{distance, steep < 0.0};
  }
  return first;
}

// The first body, of as many as little work is enough for, that falls onto the backs of triangles
// before it comes to anything else. Collision geometry is made for the first one that might.
std::optional<physics::BodyId> falls_onto_back(const Written& written, std::size_t s,
                                               const TriangleMesh& mesh) {
  constexpr std::size_t kMostTriangles = 20'000'000;
  const physics::SceneDescription& scene = written.scenario.scene;
  if (scene.gravity_m_s2.isZero(0.0)) return {};
  const Vec3 down = scene.gravity_m_s2.normalized();
  const physics::StaticBody& fixed = scene.statics[s];
  const physics::Quat to_mesh = fixed.orientation.conjugate();
  const auto bodies = static_cast<std::uint32_t>(written.scenario.initial.size());
  const std::size_t stride = 1 + bodies * mesh.triangles.size() / kMostTriangles;
  std::optional<physics::Geometry> geometry;
  for (std::uint32_t i = 0; i < bodies; i += static_cast<std::uint32_t>(stride)) {
    const physics::BodyId id{i};
    if (written.is_absent(id) || scene.bodies[i].kinematic ||
        !physics::groups_touch(scene, id, physics::static_id(static_cast<std::uint32_t>(s))))
      continue;
    const Vec3& from = written.scenario.initial[i].position_m;
    const std::optional<Met> met =
        first_met(mesh, to_mesh * (from - fixed.position_m), to_mesh * down);
    if (!met || !met->from_behind) continue;
    if (!geometry) geometry.emplace(scene);
    if (!physics::cast_ray(scene, *geometry, {}, {}, {from, down, met->distance_m})) return id;
  }
  return {};
}

void check_sides(const Written& written, std::size_t s, const TriangleMesh& mesh,
                 WarningList& warnings) {
  const StaticSpec& spec = written.document.statics[s];
  const JsonValue& place = *find_member(*spec.json, "shape");
  const Sides sides = sides_of(mesh);
  const char* const turn = "the corners of each triangle counter-clockwise, seen from outside";
  if (sides.disagreeing > 0)
    return warnings.add("mesh-sides", place, [&] {
      return WarningText{name_of(spec) + " in which neighbours face opposite sides at " +
                             std::to_string(sides.disagreeing) + " edges, such as of triangle " +
                             std::to_string(sides.first) + "; bodies pass through its back",
                         turn};
    });
  // A room has its faces inwards, and somebody in it.
  if (sides.closed && volume_of(mesh) < 0.0 && !starts_inside(written, *written.boxes.statics[s]))
    return warnings.add("mesh-sides", place, [&] {
      return WarningText{name_of(spec) + ", closed and inside out; bodies pass into it", turn};
    });
  if (const std::optional<physics::BodyId> body = falls_onto_back(written, s, mesh))
    warnings.add("mesh-sides", place, [&] {
      return WarningText{
          name_of(spec) + " with its back to " + written.name_of(*body) + ", which falls through",
          "the corners of each triangle counter-clockwise, seen from " + written.name_of(*body)};
    });
}

}  // namespace

void check_meshes(const Written& written, WarningList& warnings) {
  const physics::SceneDescription& scene = written.scenario.scene;
  const Around bodies = around(written);
  for (std::size_t s = 0; s < scene.statics.size(); ++s) {
    const auto* mesh = std::get_if<TriangleMesh>(&scene.shapes[scene.statics[s].shape]);
    if (!mesh || !bodies.all || !scene.solver.contact_response) continue;
    const StaticSpec& spec = written.document.statics[s];
    check_unit(spec, longest_edge_m(*written.boxes.statics[s]), bodies, warnings);
    check_sides(written, s, *mesh, warnings);
  }
}

}  // namespace soda::scenarios
