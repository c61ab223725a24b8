#include "physics/step/sent_on.hpp"

#include <algorithm>

#include "physics/continuous/time_of_impact.hpp"
#include "physics/events/linked_step.hpp"
#include "physics/forces/forces.hpp"
#include "physics/math/rigid_motion.hpp"
#include "physics/model/kinematic.hpp"
#include "physics/narrowphase/separation.hpp"
#include "physics/shapes/geometry_impl.hpp"
#include "physics/solvers/island_blocks.hpp"

namespace soda::physics {
namespace {

// Speculative states can be absurd: boxes stay finite.
void cover(const Aabb& more, Aabb& box) {
  constexpr double kLargest = 1e300;
  for (int i = 0; i < 3; ++i) {
    box.min[i] = std::clamp(std::min(box.min[i], more.min[i]), -kLargest, kLargest);
    box.max[i] = std::clamp(std::max(box.max[i], more.max[i]), -kLargest, kLargest);
  }
}

Aabb tight_box_of(const CompiledShape& shape, const BodyState& state) {
  return tight_aabb(shape, {state.orientation.toRotationMatrix(), state.position_m});
}

// A path of two straight legs: at the velocity of the start, from some time on at that of the end.
struct TwoLegs {
  Vec3 from, to;  // velocities, m/s
  Vec3 end;       // displacement, m
  double corner_s = 0.0;
  double missed_m = 0.0;  // by what the legs miss each other: the path has turned more than once
  double dt_s = 0.0;

  Vec3 at(double time_s) const {
    return time_s < corner_s ? Vec3(from * time_s) : Vec3(end - to * (dt_s - time_s));
  }
};

TwoLegs legs_of(double dt_s, const BodyState& start, const BodyState& end) {
  TwoLegs path{start.linear_velocity_m_s, end.linear_velocity_m_s,
               end.position_m - start.position_m};
  path.dt_s = dt_s;
  const Vec3 gap = path.end - path.to * dt_s, change = path.from - path.to;
  const double square = change.squaredNorm();
  if (square > 0.0) path.corner_s = std::clamp(gap.dot(change) / square, 0.0, dt_s);
  path.missed_m = (gap - change * path.corner_s).norm();
  return path;
}

// How far a rotation from one orientation to the other moves any of its points, at most.
double turned_m(const CompiledShape& shape, const Quat& from, const Quat& to) {
  if (shape.kind == ShapeKind::kSphere) return 0.0;
  return 2.0 * (to * from.conjugate()).vec().norm() * shape.bounding_radius_m;
}

// Where it ends if nothing is in its way.
BodyState foreseen(const SceneDescription& scene, BodyId id, const BodyState& start) {
  BodyState end = SeenAhead(scene, scene.dt_s, id, start).state();
  end.linear_velocity_m_s += field_of(scene, id) * scene.dt_s;
  end.position_m += end.linear_velocity_m_s * scene.dt_s;
  end.orientation = turned(end.angular_velocity_rad_s * scene.dt_s, end.orientation);
  return end;
}

// By how much its end is off that. What rests does not fall, and is not off for that.
double off_m(const SceneDescription& scene, const CompiledShape& shape, BodyId id,
             const BodyState& start, const BodyState& end) {
  const BodyState free = foreseen(scene, id, start);
  const Vec3 off = end.position_m - free.position_m;
  const Vec3 fall = field_of(scene, id) * (scene.dt_s * scene.dt_s);
  const double square = fall.squaredNorm();
  const double held = square > 0.0 ? std::clamp(-off.dot(fall) / square, 0.0, 1.0) : 0.0;
  return (off + fall * held).norm() + turned_m(shape, free.orientation, end.orientation);
}

}  // namespace

BodyId linked_label(std::span<const BodyId> ids, std::span<const ContactManifold> manifolds) {
  return is_linked(manifolds) && !is_large(manifolds) ? ids.front() : kNotLinked;
}

Need passes_needed(const SceneDescription& scene) {
  const Need contacts = contacts_needed(scene);
  if (!contacts) return contacts;
  return need_of(scene.bodies.size() > 1, "hits can send bodies on to others",
                 "one body has nobody to be sent on to");
}

void Passes::start(std::size_t bodies) {
  advanced_with_.assign(bodies, 0);
  linked_.assign(bodies, kNotLinked);
  began_.assign(bodies, 0);
  sent_as_.assign(bodies, 0);
  if (starts_.size() < bodies) starts_.resize(bodies);
  sent_.clear();
  ever_sent_.clear();
}

void Passes::begin(std::uint32_t place, std::size_t manifolds, BodyId linked, BodyState& state) {
  advanced_with_[place] = static_cast<std::uint32_t>(manifolds);
  linked_[place] = linked;
  if (began_[place])
    state = starts_[place];
  else
    starts_[place] = state;
  began_[place] = 1;
}

void Passes::keep(std::uint32_t place, std::size_t manifolds) {
  advanced_with_[place] = static_cast<std::uint32_t>(manifolds);
}

// A path that turned more than once can have been farther out than where it ended: on its last leg.
void Passes::end(const SceneDescription& scene, const Geometry& geometry, BodyId id,
                 std::uint32_t place, const BodyState& state, const Aabb* box) {
  if (!scene.solver.contact_response) return;
  const BodyState& start = starts_[place];
  const CompiledShape& shape = shape_of(scene, geometry, id);
  const double smooth_m = kContactMargin * shape.min_extent_m;
  if (!was_sent(place) && off_m(scene, shape, id, start, state) <= smooth_m) return;
  if (!was_sent(place)) {
    ever_sent_.push_back({place, box != nullptr ? *box : swept_aabb(scene, geometry, id, start)});
    sent_as_[place] = static_cast<std::uint32_t>(ever_sent_.size());
  }
  Sent& sent = ever_sent_[sent_as_[place] - 1];
  Aabb reached = tight_box_of(shape, state);
  if (legs_of(scene.dt_s, start, state).missed_m > smooth_m) {
    const Vec3 back = state.linear_velocity_m_s * scene.dt_s;
    cover({reached.min - back, reached.max - back}, reached);
  }
  cover(reached, sent.box);
  sent_.push_back(sent);
}

BodyState Passes::end_of(const SceneDescription& scene, BodyId id, std::uint32_t place,
                         const BodyState& now) const {
  return is_free(place) ? foreseen(scene, id, now) : now;
}

bool may_meet(const SceneDescription& scene, const Geometry& geometry, const MovingBody& a,
              const MovingBody& b, StageCounters& counters) {
  if (a.linked != kNotLinked && a.linked == b.linked) return false;
  if (!overlap(a.box, b.box) || !may_touch(scene, a.id, a.start, b.id)) return false;
  ++counters.sent_searches;
  const auto [normal, distance_m] =
      separation_of({scene, geometry, scene.dt_s, a.id, a.start, b.id, &b.start});
  const TwoLegs path_a = legs_of(scene.dt_s, a.start, a.end),
                path_b = legs_of(scene.dt_s, b.start, b.end);
  double closed_m = 0.0;
  for (const double time_s : {path_a.corner_s, path_b.corner_s, scene.dt_s})
    closed_m = std::max(closed_m, (path_a.at(time_s) - path_b.at(time_s)).dot(normal));
  if (distance_m <= closed_m + path_a.missed_m + path_b.missed_m) return true;
  return separation_of({scene, geometry, scene.dt_s, a.id, a.end, b.id, &b.end}).distance_m <= 0.0;
}

bool connect(const SceneDescription& scene, BodyId a, const BodyState& start_a, BodyId b,
             std::vector<ContactManifold>& manifolds) {
  ContactManifold link;
  link.a = a;
  link.b = b;
  const auto at = std::ranges::lower_bound(manifolds, link, canonical_before);
  if (at != manifolds.end() && at->a == a && at->b == b) return false;
  if (!may_touch(scene, a, start_a, b)) return false;
  manifolds.insert(at, link);
  return true;
}

}  // namespace soda::physics
