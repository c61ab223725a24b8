// Bodies that start within each other, within statics, or beneath a floor.
#include <algorithm>
#include <cmath>
#include <optional>

#include "physics/model/joint.hpp"
#include "physics/shapes/geometry.hpp"
#include "scenarios/placed_boxes.hpp"
#include "scenarios/warnings.hpp"

namespace soda::scenarios {
namespace {

using physics::Aabb;
using physics::BodyId;

// An overlap is deep from this part of the smaller one's smallest width on.
constexpr double kDeep = 0.1;

double width_m(const Written& written, std::uint32_t body) {
  return written.boxes.shapes[written.scenario.scene.bodies[body].shape].min_extent_m;
}

std::string name_of(const physics::StaticBody& body) {
  return "static " + json_quoted(printable(body.name));
}

WarningText of_overlap(const std::string& who, const std::string& whom, double depth_m,
                       const char* likely) {
  return {who + " that overlaps " + whom + " by " + about(depth_m) + " m", likely};
}

// Depths of pairs. Collision geometry is made for the first pair that needs it: most scenes have
// none.
class Depths {
 public:
  explicit Depths(const Scenario& scenario) : scenario_(scenario) {}

  // 0 if they do not overlap, or do not collide for a joint between them.
  double of(BodyId a, BodyId b) {
    if (!geometry_) geometry_.emplace(scenario_.scene);
    found_.clear();
    const bool fixed = physics::is_static(b);
    constexpr double kNow = 0.0;  // no look ahead
    physics::collide({scenario_.scene, *geometry_, kNow, a, scenario_.initial[index_of(a)], b,
                      fixed ? nullptr : &scenario_.initial[index_of(b)]},
                     found_, counters_);
    double depth = 0.0;
    for (const physics::ContactManifold& manifold : found_) {
      if (physics::is_joint(manifold)) continue;
      for (std::uint32_t i = 0; i < manifold.count; ++i)
        depth = std::max(depth, -manifold.points[i].separation_m);
    }
    return depth;
  }

 private:
  const Scenario& scenario_;
  std::optional<physics::Geometry> geometry_;
  std::vector<physics::ContactManifold> found_;
  physics::StageCounters counters_;
};

// Two boxes overlap by no more than this along some axis, and so do what is in them.
double room_m(const Aabb& a, const Aabb& b) {
  return (a.max.cwiseMin(b.max) - a.min.cwiseMax(b.min)).minCoeff();
}

// Compounds can have a hole in the middle, in which others are.
bool are_rings(const Written& written, std::uint32_t a, std::uint32_t b) {
  const physics::SceneDescription& scene = written.scenario.scene;
  const auto is_compound = [&](std::uint32_t body) {
    return std::holds_alternative<physics::Compound>(scene.shapes[scene.bodies[body].shape]);
  };
  return scene.bodies[a].shape != scene.bodies[b].shape && (is_compound(a) || is_compound(b));
}

// Tells of bodies with one centre, and returns the others and one of each such heap: what follows
// must not meet all the pairs of a thousand bodies in one place.
std::vector<std::uint32_t> without_coincident(const Written& written, WarningList& warnings) {
  std::vector<std::uint32_t> there, kept;
  for (std::uint32_t i = 0; i < written.scenario.initial.size(); ++i)
    if (!written.is_absent(BodyId{i})) there.push_back(i);
  const auto centre = [&](std::uint32_t i) {
    const physics::Vec3& c = written.scenario.initial[i].position_m;
    return std::array{c.x(), c.y(), c.z()};
  };
  std::ranges::stable_sort(there, {}, centre);
  std::uint32_t first = 0;
  for (const std::uint32_t i : there) {
    const bool new_place = kept.empty() || centre(first) != centre(i);
    if (new_place) kept.push_back(first = i);
    const bool ring = !new_place && are_rings(written, first, i);
    if (ring) kept.push_back(i);
    if (new_place || ring ||
        !physics::may_touch(written.scenario.scene, BodyId{first}, written.scenario.initial[first],
                            BodyId{i}))
      continue;
    warnings.add("overlap", *written.places[i], [&] {
      return WarningText{
          written.name_of(BodyId{i}) + " with the centre of " + written.name_of(BodyId{first}),
          "another position, or wider spacing"};
    });
  }
  std::ranges::sort(kept);
  return kept;
}

const physics::HalfSpace* halfspace_of(const Written& written, const physics::StaticBody& body) {
  return std::get_if<physics::HalfSpace>(&written.scenario.scene.shapes[body.shape]);
}

// Of body `i` with a halfspace: what is beneath its surface, if it is much.
void check_halfspace(const Written& written, std::uint32_t i, const physics::StaticBody& floor,
                     WarningList& warnings) {
  const physics::HalfSpace& half = *halfspace_of(written, floor);
  const physics::Vec3 normal = floor.orientation * half.normal;
  const physics::Pose pose = pose_of(written.scenario.initial[i]);
  const auto& shape = written.boxes.shapes[written.scenario.scene.bodies[i].shape];
  const double height = normal.dot(pose.position - floor.position_m) - half.offset_m;
  const double below =
      -normal.dot(pose.rotation * support(shape, pose.direction_to_local(-normal)));
  if (height < 0.0)
    warnings.add("below-floor", *written.places[i], [&] {
      return WarningText{written.name_of(BodyId{i}) + " with its centre " + about(-height) +
                             " m beneath " + name_of(floor),
                         "a place on the side to which its normal points"};
    });
  else if (below - height > kDeep * shape.min_extent_m)
    warnings.add("overlap-static", *written.places[i], [&] {
      return of_overlap(written.name_of(BodyId{i}), name_of(floor), below - height,
                        "a higher place; position_m is that of the centre");
    });
}

// The box around all statics, if none is a halfspace.
std::optional<Aabb> box_of_statics(const Written& written) {
  std::optional<Aabb> all;
  for (const std::optional<Aabb>& box : written.boxes.statics) {
    if (!box) return std::nullopt;
    all = all ? joined(*all, *box) : *box;
  }
  return all;
}

// Of the box's points, times the length of `direction`.
double lowest_along(const physics::Vec3& direction, const Aabb& box) {
  return direction.cwiseProduct(box.min).cwiseMin(direction.cwiseProduct(box.max)).sum();
}

bool ray_meets(const physics::Vec3& from, const physics::Vec3& along, const Aabb& box) {
  double enter = 0.0, leave = 1e300;
  for (int i = 0; i < 3; ++i) {
    if (along[i] == 0.0) {
      if (from[i] < box.min[i] || from[i] > box.max[i]) return false;
      continue;
    }
    const double a = (box.min[i] - from[i]) / along[i], b = (box.max[i] - from[i]) / along[i];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter <= leave;
}

bool holds_itself(const Written& written, std::uint32_t i, const physics::Vec3& up) {
  const physics::BodyParams& body = written.scenario.scene.bodies[i];
  return body.kinematic || body.joints > 0 || body.drive != physics::kNoDrive ||
         physics::is_forced(body) || written.scenario.initial[i].linear_velocity_m_s.dot(up) > 0.0;
}

}  // namespace

void check_overlaps(const Written& written, WarningList& warnings) {
  const Scenario& scenario = written.scenario;
  if (!scenario.scene.solver.contact_response) return;
  const std::vector<std::uint32_t> bodies = without_coincident(written, warnings);
  std::vector<Aabb> boxes;
  boxes.reserve(bodies.size() + written.boxes.statics.size());
  for (const std::uint32_t i : bodies) boxes.push_back(written.boxes.bodies[i]);
  std::vector<std::uint32_t> statics;
  for (std::uint32_t s = 0; s < written.boxes.statics.size(); ++s)
    if (written.boxes.statics[s]) {
      statics.push_back(s);
      boxes.push_back(*written.boxes.statics[s]);
    }
  std::vector<physics::IndexPair> pairs;
  physics::StageCounters counters;
  physics::find_pairs(physics::Broadphase::kGrid, boxes, pairs, counters);
  Depths depths(scenario);
  for (const physics::IndexPair& pair : pairs) {
    if (pair.first >= bodies.size()) continue;  // two statics
    const std::uint32_t a = bodies[pair.first];
    const bool fixed = pair.second >= bodies.size();
    const std::uint32_t other = fixed ? statics[pair.second - bodies.size()] : bodies[pair.second];
    const double width =
        fixed ? width_m(written, a) : std::min(width_m(written, a), width_m(written, other));
    if (room_m(boxes[pair.first], boxes[pair.second]) <= kDeep * width) continue;
    const double depth = depths.of(BodyId{a}, fixed ? physics::static_id(other) : BodyId{other});
    if (depth <= kDeep * width) continue;
    const std::uint32_t told = fixed ? a : other;
    warnings.add(fixed ? "overlap-static" : "overlap", *written.places[told], [&] {
      return of_overlap(written.name_of(BodyId{told}),
                        fixed ? name_of(scenario.scene.statics[other]) : written.name_of(BodyId{a}),
                        depth,
                        fixed ? "another position; position_m is that of the centre"
                              : "another position, or wider spacing; size_m are full lengths");
    });
  }
}

void check_floors(const Written& written, WarningList& warnings) {
  const physics::SceneDescription& scene = written.scenario.scene;
  if (!scene.solver.contact_response) return;
  std::vector<const physics::StaticBody*> floors;
  for (const physics::StaticBody& body : scene.statics)
    if (halfspace_of(written, body)) floors.push_back(&body);
  const std::optional<Aabb> statics = box_of_statics(written);
  const physics::Vec3 up = -scene.gravity_m_s2;
  for (std::uint32_t i = 0; i < scene.bodies.size(); ++i) {
    if (written.is_absent(BodyId{i}) || scene.bodies[i].kinematic) continue;
    for (const physics::StaticBody* floor : floors) check_halfspace(written, i, *floor, warnings);
    if (!statics || up.isZero(0.0) || holds_itself(written, i, up)) continue;
    if (-lowest_along(-up, written.boxes.bodies[i]) >= lowest_along(up, *statics)) continue;
    if (!ray_meets(written.scenario.initial[i].position_m, up, *statics)) continue;
    warnings.add("below-floor", *written.places[i], [&] {
      return WarningText{written.name_of(BodyId{i}) + " beneath all statics",
                         "a place above them, or gravity the other way"};
    });
  }
}

}  // namespace soda::scenarios
