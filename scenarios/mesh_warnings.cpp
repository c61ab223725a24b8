// Meshes of another unit, or with triangles the wrong way round.
#include <algorithm>
#include <array>

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

// Six times the volume that the triangles enclose; twice the sum of their areas, as vectors and as
// numbers.
struct Sums {
  double volume = 0.0, area = 0.0;
  Vec3 faces = Vec3::Zero();
};

Sums sums_of(const TriangleMesh& mesh) {
  Sums sums;
  const Vec3& origin = mesh.vertices_m.front();
  for (const auto& t : mesh.triangles) {
    const Vec3 a = mesh.vertices_m[t[0]] - origin, b = mesh.vertices_m[t[1]] - origin,
               c = mesh.vertices_m[t[2]] - origin;
    const Vec3 face = Vec3(b - a).cross(Vec3(c - a));
    sums.volume += a.dot(b.cross(c));
    sums.faces += face;
    sums.area += face.norm();
  }
  return sums;
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

// Whether some body is over the box, as gravity sees it.
bool starts_above(const Written& written, const Aabb& box) {
  const Vec3 down = written.scenario.scene.gravity_m_s2;
  for (const physics::BodyState& state : written.scenario.initial) {
    const Vec3 from = state.position_m - 0.5 * (box.min + box.max);
    const Vec3 half = 0.5 * (box.max - box.min);
    const Vec3 across = from - down * (from.dot(down) / down.squaredNorm());
    if (from.dot(down) < 0.0 && (across.cwiseAbs() - half).maxCoeff() <= 0.0) return true;
  }
  return false;
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
  const Sums sums = sums_of(mesh);
  const Aabb& box = *written.boxes.statics[s];
  // A room has its faces inwards, and somebody in it.
  if (sides.closed && sums.volume < 0.0 && !starts_inside(written, box))
    return warnings.add("mesh-sides", place, [&] {
      return WarningText{name_of(spec) + ", closed and inside out; bodies pass into it", turn};
    });
  const Vec3& down = written.scenario.scene.gravity_m_s2;
  const Vec3 faces = written.scenario.scene.statics[s].orientation * sums.faces;
  const bool falls = faces.dot(down) > 0.5 * sums.area * down.norm() && !down.isZero(0.0);
  if (!sides.closed && falls && starts_above(written, box))
    warnings.add("mesh-sides", place, [&] {
      return WarningText{name_of(spec) +
                             ", open and with its faces down; what is above falls "
                             "through",
                         "the corners of each triangle counter-clockwise, seen from above"};
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
