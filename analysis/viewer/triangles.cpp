#include "analysis/viewer/triangles.hpp"

#include <cmath>
#include <numbers>

namespace soda::analysis {
namespace {

using physics::Vec3;

struct Corner {
  Vec3 position_m, normal;
};

class Surface {
 public:
  // What is round has so many.
  explicit Surface(int sides) : sides_(sides) {}
  int sides() const { return sides_; }
  void triangle(const Corner& a, const Corner& b, const Corner& c) {
    for (const Corner* corner : {&a, &b, &c})
      for (const Vec3* v : {&corner->position_m, &corner->normal})
        for (int i = 0; i < 3; ++i) floats_.push_back(static_cast<float>((*v)[i]));
  }
  // Flat; corners in order around it.
  template <class CornerAt>
  void face(std::size_t corners, CornerAt corner_at) {
    const Vec3 first = corner_at(0);
    for (std::size_t i = 2; i < corners; ++i) {
      const Vec3 b = corner_at(i - 1), c = corner_at(i);
      const Vec3 normal = (b - first).cross(c - first).stableNormalized();
      triangle({first, normal}, {b, normal}, {c, normal});
    }
  }
  Triangles floats() && { return std::move(floats_); }

 private:
  const int sides_;
  Triangles floats_;
};

// A circle of a body that is round about its z axis; the normal there is (cos, sin) times
// `normal_out` and `normal_up`.
struct Ring {
  double radius_m, height_m, normal_out, normal_up;

  Corner at(int side, int sides) const {
    const double angle = 2.0 * std::numbers::pi * side / sides;
    const Vec3 out(std::cos(angle), std::sin(angle), 0.0);
    return {radius_m * out + height_m * Vec3::UnitZ(),
            normal_out * out + normal_up * Vec3::UnitZ()};
  }
};

// Between two circles, of which `below` may be a point, or `above`.
void add_band(Surface& surface, const Ring& below, const Ring& above) {
  const int sides = surface.sides();
  for (int side = 0; side < sides; ++side) {
    const Corner from = below.at(side, sides), to = above.at(side + 1, sides);
    if (below.radius_m > 0.0) surface.triangle(from, below.at(side + 1, sides), to);
    if (above.radius_m > 0.0) surface.triangle(from, to, above.at(side, sides));
  }
}

void add(Surface& surface, const physics::Capsule& capsule) {
  const int quarter = surface.sides() / 4;  // rings from pole to equator
  const auto ring = [&](int i, double middle_m) {
    const double latitude = 0.5 * std::numbers::pi * i / quarter;
    const double out = std::abs(i) == quarter ? 0.0 : std::cos(latitude);
    const double up = std::sin(latitude);
    return Ring{capsule.radius_m * out, middle_m + capsule.radius_m * up, out, up};
  };
  const double end_m = capsule.length_m / 2.0;
  for (int i = -quarter; i < 0; ++i) add_band(surface, ring(i, -end_m), ring(i + 1, -end_m));
  if (end_m > 0.0) add_band(surface, ring(0, -end_m), ring(0, end_m));
  for (int i = 0; i < quarter; ++i) add_band(surface, ring(i, end_m), ring(i + 1, end_m));
}

void add(Surface& surface, const physics::Sphere& sphere) {
  add(surface, physics::Capsule{.radius_m = sphere.radius_m, .length_m = 0.0});
}

void add(Surface& surface, const physics::Cylinder& cylinder) {
  const double r = cylinder.radius_m, end_m = cylinder.length_m / 2.0;
  add_band(surface, {0.0, -end_m, 0.0, -1.0}, {r, -end_m, 0.0, -1.0});
  add_band(surface, {r, -end_m, 1.0, 0.0}, {r, end_m, 1.0, 0.0});
  add_band(surface, {r, end_m, 0.0, 1.0}, {0.0, end_m, 0.0, 1.0});
}

void add(Surface& surface, const physics::Box& box) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      const Vec3 out = sign * Vec3::Unit(axis);
      const Vec3 along = Vec3::Unit((axis + 1) % 3), across = out.cross(along);
      const auto corner = [&](double i, double k) -> Vec3 {
        return box.half_extents_m.cwiseProduct(out + i * along + k * across);
      };
      const Vec3 corners[] = {corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)};
      surface.face(4, [&](std::size_t i) { return corners[i]; });
    }
  }
}

void add(Surface& surface, const physics::ConvexHull& hull) {
  for (const std::vector<std::uint32_t>& face : hull.faces)
    surface.face(face.size(), [&](std::size_t i) { return hull.vertices_m[face[i]]; });
}

void add(Surface& surface, const physics::TriangleMesh& mesh) {
  for (const std::array<std::uint32_t, 3>& triangle : mesh.triangles)
    surface.face(3, [&](std::size_t i) { return mesh.vertices_m[triangle[i]]; });
}

void add_square(Surface& surface, const physics::HalfSpace& solid, const Vec3& middle_m,
                double reach_m) {
  const Vec3 centre = middle_m - (solid.normal.dot(middle_m) - solid.offset_m) * solid.normal;
  const Vec3 along = solid.normal.unitOrthogonal(), across = solid.normal.cross(along);
  const auto corner = [&](double i, double k) -> Vec3 {
    return centre + reach_m * (i * along + k * across);
  };
  const Vec3 corners[] = {corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)};
  surface.face(4, [&](std::size_t i) { return corners[i]; });
}

// Each whole, where the others hide it, too.
Triangles parts_of(const physics::Compound& compound, std::span<const physics::Shape> shapes,
                   int sides) {
  Triangles all;
  for (const physics::CompoundPart& part : compound.parts) {
    const Triangles own = triangles_of(shapes[part.shape], shapes, Vec3::Zero(), 0.0, sides);
    for (std::size_t i = 0; i + 2 < own.size(); i += 3) {
      const Vec3 turned = part.orientation * Vec3(own[i], own[i + 1], own[i + 2]);
      const bool is_position = i % 6 == 0;
      const Vec3 v = is_position ? Vec3(turned + part.position_m) : turned;
      for (int k = 0; k < 3; ++k) all.push_back(static_cast<float>(v[k]));
    }
  }
  return all;
}

}  // namespace

Triangles triangles_of(const physics::Shape& shape, std::span<const physics::Shape> shapes,
                       const Vec3& middle_m, double reach_m, int sides) {
  if (const auto* compound = std::get_if<physics::Compound>(&shape))
    return parts_of(*compound, shapes, sides);
  Surface surface(sides);
  const auto draw = [&](const auto& solid) {
    if constexpr (std::is_same_v<std::decay_t<decltype(solid)>, physics::HalfSpace>)
      add_square(surface, solid, middle_m, reach_m);
    else if constexpr (!std::is_same_v<std::decay_t<decltype(solid)>, physics::Compound>)
      add(surface, solid);
  };
  std::visit(draw, shape);
  return std::move(surface).floats();
}

}  // namespace soda::analysis
