#include "physics/shapes/mass_properties.hpp"

#include <cmath>

namespace soda::physics {
namespace {

constexpr double kPi = 3.14159265358979323846;

MassProperties solid_of_revolution(double volume, double across, double along) {
  MassProperties out;
  out.volume_m3 = volume;
  out.inertia_per_density_m5 = Vec3(across, across, along).asDiagonal();
  return out;
}

MassProperties of(const Sphere& s) {
  const double volume = 4.0 / 3.0 * kPi * s.radius_m * s.radius_m * s.radius_m;
  const double moment = 0.4 * volume * s.radius_m * s.radius_m;
  return solid_of_revolution(volume, moment, moment);
}

MassProperties of(const Box& b) {
  const Vec3& h = b.half_extents_m;
  MassProperties out;
  out.volume_m3 = 8.0 * h.x() * h.y() * h.z();
  const Vec3 squares = h.cwiseProduct(h);
  const Vec3 moments(squares.y() + squares.z(), squares.x() + squares.z(),
                     squares.x() + squares.y());
  out.inertia_per_density_m5 = Vec3(moments * (out.volume_m3 / 3.0)).asDiagonal();
  return out;
}

MassProperties of(const Cylinder& c) {
  const double r2 = c.radius_m * c.radius_m;
  const double volume = kPi * r2 * c.length_m;
  return solid_of_revolution(volume, volume * (3.0 * r2 + c.length_m * c.length_m) / 12.0,
                             0.5 * volume * r2);
}

MassProperties of(const Capsule& c) {
  const double r = c.radius_m, l = c.length_m;
  const MassProperties middle = of(Cylinder{r, l});
  const double caps = 4.0 / 3.0 * kPi * r * r * r;
  // A hemisphere's centre lies 3r/8 beyond its plane; its moment across, about the sphere's centre,
  // is that of half a sphere.
  const double across = caps * (0.4 * r * r + 0.25 * l * l + 0.375 * l * r);
  return solid_of_revolution(middle.volume_m3 + caps, middle.inertia_per_density_m5(0, 0) + across,
                             middle.inertia_per_density_m5(2, 2) + 0.4 * caps * r * r);
}

// Sums over the tetrahedra between an inner point and the faces' triangles. Integrals over a
// tetrahedron with one corner at the origin: volume det/6, first moment V (a+b+c)/4, second moments
// V/20 (sum of x_i x_j + sum x_i sum x_j).
MassProperties of(const ConvexHull& hull) {
  const Vec3& inside = hull.vertices_m.front();
  double volume = 0.0;
  Vec3 first = Vec3::Zero();
  Mat3 second = Mat3::Zero();
  for (const auto& face : hull.faces) {
    for (std::size_t i = 1; i + 1 < face.size(); ++i) {
      const Vec3 a = hull.vertices_m[face[0]] - inside;
      const Vec3 b = hull.vertices_m[face[i]] - inside;
      const Vec3 c = hull.vertices_m[face[i + 1]] - inside;
      const double v = a.dot(b.cross(c)) / 6.0;
      const Vec3 sum = a + b + c;
      volume += v;
      first += sum * (v / 4.0);
      const Mat3 squares =
          a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose();
      second += squares * (v / 20.0);
    }
  }
  MassProperties out;
  out.volume_m3 = volume;
  if (!(volume > 0.0)) return out;
  const Vec3 center = first / volume;
  second -= center * center.transpose() * volume;
  out.center_local_m = inside + center;
  out.inertia_per_density_m5 = second.trace() * Mat3::Identity() - second;
  return out;
}

MassProperties of(const TriangleMesh&) { return {}; }
MassProperties of(const HalfSpace&) { return {}; }

MassProperties of(const Compound& compound, std::span<const Shape> shapes) {
  std::vector<MassProperties> parts;
  MassProperties out;
  Vec3 first = Vec3::Zero();
  for (const CompoundPart& part : compound.parts) {
    MassProperties& p = parts.emplace_back(mass_properties(shapes[part.shape]));
    const Mat3 rotation = part.orientation.toRotationMatrix();
    p.center_local_m = part.position_m + rotation * p.center_local_m;
    p.inertia_per_density_m5 = rotation * p.inertia_per_density_m5 * rotation.transpose();
    out.volume_m3 += p.volume_m3;
    first += p.center_local_m * p.volume_m3;
  }
  out.center_local_m = first / out.volume_m3;
  for (const MassProperties& p : parts)
    out.inertia_per_density_m5 +=
        inertia_about(p.inertia_per_density_m5, p.volume_m3, p.center_local_m - out.center_local_m);
  // To the last bit symmetric: rounding of a product is not.
  const Mat3 turned = out.inertia_per_density_m5.transpose();
  out.inertia_per_density_m5 = 0.5 * (out.inertia_per_density_m5 + turned);
  return out;
}

}  // namespace

Mat3 inertia_about(const Mat3& about_center, double mass, const Vec3& offset_m) {
  return about_center +
         mass * (offset_m.squaredNorm() * Mat3::Identity() - offset_m * offset_m.transpose());
}

MassProperties mass_properties(const Shape& shape, std::span<const Shape> shapes) {
  if (const auto* compound = std::get_if<Compound>(&shape)) return of(*compound, shapes);
  return std::visit(
      [](const auto& solid) -> MassProperties {
        if constexpr (std::is_same_v<std::decay_t<decltype(solid)>, Compound>)
          return {};
        else
          return of(solid);
      },
      shape);
}

}  // namespace soda::physics
