// What is asked of a simulation's contacts and space.
#include <cmath>
#include <string>
#include <variant>

#include "library/src/simulation_impl.hpp"
#include "physics/queries/overlaps.hpp"
#include "physics/queries/ray_cast.hpp"
#include "physics/shapes/mass_properties.hpp"
#include "physics/step/contact_loads.hpp"

namespace soda {
namespace {

void require_positive(double length_m, const char* what) {
  if (!(length_m > 0.0 && std::isfinite(length_m)))
    throw UsageError(std::string(what) + ": found " + std::to_string(length_m) +
                     " m; allowed: above 0");
}

// The solid in the layer's frame, whose origin is its centre.
struct Placed {
  physics::Shape shape;
  physics::Vec3 center_m = physics::Vec3::Zero();
};

struct Place {
  Placed operator()(const Sphere& s) const {
    require_positive(s.radius_m, "radius_m");
    return {physics::Sphere{s.radius_m}};
  }
  Placed operator()(const Box& s) const {
    for (const double length : {s.size_m.x, s.size_m.y, s.size_m.z})
      require_positive(length, "size_m");
    return {physics::Box{0.5 * inner(s.size_m)}};
  }
  Placed operator()(const Capsule& s) const {
    require_positive(s.radius_m, "radius_m");
    require_positive(s.length_m, "length_m");
    return {physics::Capsule{s.radius_m, s.length_m}};
  }
  Placed operator()(const Cylinder& s) const {
    require_positive(s.radius_m, "radius_m");
    require_positive(s.length_m, "length_m");
    return {physics::Cylinder{s.radius_m, s.length_m}};
  }
  Placed operator()(const Hull& s) const {
    std::vector<physics::Vec3> points;
    for (const Vec3& point : s.points_m) points.push_back(inner(point));
    auto made = physics::make_convex_hull(points);
    if (const auto* const why = std::get_if<std::string>(&made))
      throw UsageError("points_m: found " + *why + "; allowed: points of a solid");
    auto& hull = std::get<physics::ConvexHull>(made);
    const physics::Vec3 center = physics::mass_properties(hull).center_local_m;
    for (physics::Vec3& vertex : hull.vertices_m) vertex -= center;
    return {std::move(hull), center};
  }
};

}  // namespace

std::vector<Contact> Simulation::contacts() const {
  const physics::SceneDescription& scene = *impl_->description;
  std::vector<Contact> contacts;
  for (const physics::ContactLoad& load :
       physics::contact_loads(scene, impl_->base.geometry, impl_->now.ids, impl_->now.states)) {
    Contact& contact = contacts.emplace_back();
    contact.a = outer(scene, load.a);
    contact.b = outer(scene, load.b);
    contact.touching = load.point.has_value();
    if (load.point) {
      contact.position_m = outer(load.point->position_m);
      contact.separation_m = load.point->separation_m;
    }
    contact.normal = outer(load.normal);
    contact.normal_newton = load.normal_newton;
    contact.friction_newton = outer(load.friction_newton);
    contact.normal_impulse_newton_s = load.normal_newton * scene.dt_s;
  }
  return contacts;
}

std::optional<RayHit> Simulation::cast_ray(const Vec3& from_m, const Vec3& direction,
                                           double length_m) const {
  const double norm = inner(direction).norm();
  if (!(norm > 0.0 && std::isfinite(norm)))
    throw UsageError("a ray without direction; allowed: a vector of any length above 0");
  require_positive(length_m, "length_m");
  const auto hit =
      physics::cast_ray(*impl_->description, impl_->base.geometry, impl_->now.ids,
                        impl_->now.states, {inner(from_m), inner(direction) / norm, length_m});
  if (!hit) return std::nullopt;
  return RayHit{outer(*impl_->description, hit->id), hit->distance_m, outer(hit->point_m),
                outer(hit->normal)};
}

std::vector<Neighbour> Simulation::neighbours(const ConvexShape& shape, const Vec3& position_m,
                                              const Quat& orientation, double within_m) const {
  if (!(within_m >= 0.0)) throw UsageError("within_m: allowed: at least 0");
  Placed placed = std::visit(Place(), shape);
  const physics::Quat turn = inner(orientation).normalized();
  const physics::Vec3 center = inner(position_m) + turn._transformVector(placed.center_m);
  std::vector<Neighbour> neighbours;
  for (const physics::Neighbour& near : physics::find_neighbours(
           *impl_->description, impl_->base.geometry, impl_->now.ids, impl_->now.states,
           {std::move(placed.shape), center, turn, within_m}))
    neighbours.push_back(
        {outer(*impl_->description, near.id), near.distance_m, outer(near.normal)});
  return neighbours;
}

}  // namespace soda
