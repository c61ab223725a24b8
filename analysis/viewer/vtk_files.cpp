#include "analysis/viewer/vtk_files.hpp"

#include <array>
#include <map>
#include <vector>

#include "analysis/event_log/logged_run.hpp"
#include "analysis/runs/measured_run.hpp"
#include "analysis/viewer/recording.hpp"
#include "analysis/viewer/vtk_poly_data.hpp"
#include "physics/step/contact_loads.hpp"

namespace soda::analysis {
namespace {

using physics::Quat;
using physics::Vec3;

constexpr std::int64_t kNoBody = -1;

template <class Vector>
void append_numbers(std::vector<double>& numbers, const Vector& vector) {
  for (int i = 0; i < vector.size(); ++i) numbers.push_back(vector[i]);
}

// A step and what is known of its bodies, each in the order of its ids.
struct VtkStep {
  const LoggedStep& logged;
  std::int64_t step;
  double time_s;
  std::vector<std::int64_t> labels, worlds, islands;
};

VtkStep known_of(const LoggedStep& logged, const LogReader& log,
                 const physics::SceneDescription& scene, const models::TerritoryMap& map) {
  VtkStep of{logged, logged.step, static_cast<double>(logged.step) * scene.dt_s, {}, {}, {}};
  for (const physics::BodyId id : logged.ids)
    of.labels.push_back(log.labels()[physics::index_of(id)]);
  for (const physics::BodyState& state : logged.states)
    of.worlds.push_back(models::index_of(map.owner_at(state.position_m)));
  for (const std::uint32_t first : islands_of(logged, scene))
    of.islands.push_back(of.labels[first]);
  return of;
}

void add_about(const VtkStep& of, VtkPolyData& data) {
  data.add("body", of.labels);
  data.add("world", of.worlds);
  data.add("island", of.islands);
}

std::string bodies_text(const VtkStep& of) {
  std::vector<double> places, orientations, velocities, turns;
  for (const physics::BodyState& state : of.logged.states) {
    const Quat& q = state.orientation;
    append_numbers(places, state.position_m);
    append_numbers(orientations, Eigen::Vector4d(q.w(), q.x(), q.y(), q.z()));
    append_numbers(velocities, state.linear_velocity_m_s);
    append_numbers(turns, state.angular_velocity_rad_s);
  }
  VtkPolyData data(of.step, of.time_s);
  data.set_points(places);
  data.add("orientation_wxyz", orientations, 4);
  data.add("linear_velocity_m_s", velocities, 3);
  data.add("angular_velocity_rad_s", turns, 3);
  add_about(of, data);
  return data.text();
}

std::string contacts_text_of(const VtkStep& of, const LogReader& log,
                             const std::vector<physics::ContactLoad>& loads) {
  std::vector<double> places, forces, normals, presses, frictions, depths;
  std::vector<std::int64_t> bodies, others, statics;
  for (const physics::ContactLoad& load : loads) {
    const bool with_static = physics::is_static(load.b);
    append_numbers(places, load.point->position_m);
    append_numbers(forces, Vec3(load.normal * load.normal_newton + load.friction_newton));
    append_numbers(normals, load.normal);
    presses.push_back(load.normal_newton);
    frictions.push_back(load.friction_newton.norm());
    depths.push_back(-load.point->separation_m);
    bodies.push_back(log.labels()[physics::index_of(load.a)]);
    others.push_back(with_static ? kNoBody : log.labels()[physics::index_of(load.b)]);
    statics.push_back(with_static ? physics::static_index_of(load.b) : kNoBody);
  }
  VtkPolyData data(of.step, of.time_s);
  data.set_points(places);
  data.add("force_newton", forces, 3);
  data.add("normal", normals, 3);
  data.add("normal_newton", presses);
  data.add("friction_newton", frictions);
  data.add("depth_m", depths);
  data.add("body", bodies);
  data.add("other", others);
  data.add("static", statics);
  return data.text();
}

// A surface whose corners are shared by its triangles.
struct SharedSurface {
  std::vector<Vec3> points_m;
  std::vector<std::int32_t> corners;
};

SharedSurface shared_corners(const Triangles& triangles) {
  SharedSurface surface;
  std::map<std::array<float, 3>, std::int32_t> known;
  for (std::size_t i = 0; i + 5 < triangles.size(); i += 6) {
    const std::array<float, 3> at{triangles[i], triangles[i + 1], triangles[i + 2]};
    const auto [place, is_new] = known.try_emplace(at, static_cast<std::int32_t>(known.size()));
    if (is_new) surface.points_m.emplace_back(at[0], at[1], at[2]);
    surface.corners.push_back(place->second);
  }
  return surface;
}

// Surfaces in the world's frame, and what is said of each triangle.
class SurfaceList {
 public:
  void add(const SharedSurface& surface, const Vec3& position_m, const Quat& orientation) {
    const auto first = static_cast<std::int32_t>(floats_.size() / 3);
    for (const Vec3& own : surface.points_m) {
      const Vec3 at = position_m + orientation * own;
      for (int i = 0; i < 3; ++i) floats_.push_back(static_cast<float>(at[i]));
    }
    for (const std::int32_t corner : surface.corners) corners_.push_back(first + corner);
    triangles_.push_back(surface.corners.size() / 3);
  }
  // A number for each surface stands for all its triangles.
  void say(const std::string& name, const std::vector<std::int64_t>& numbers) {
    std::vector<std::int64_t>& all = said_.emplace_back(name, std::vector<std::int64_t>()).second;
    for (std::size_t i = 0; i < numbers.size(); ++i)
      all.insert(all.end(), triangles_[i], numbers[i]);
  }
  std::string text(std::int64_t step, double time_s) const {
    VtkPolyData data(step, time_s);
    data.set_points(floats_, corners_);
    for (const auto& [name, numbers] : said_) data.add(name, numbers);
    return data.text();
  }

 private:
  std::vector<float> floats_;
  std::vector<std::int32_t> corners_;
  std::vector<std::size_t> triangles_;
  std::vector<std::pair<std::string, std::vector<std::int64_t>>> said_;
};

std::string surfaces_text(const VtkStep& of, const physics::SceneDescription& scene,
                          const std::vector<SharedSurface>& shapes) {
  SurfaceList list;
  for (std::size_t i = 0; i < of.logged.ids.size(); ++i) {
    const physics::BodyState& state = of.logged.states[i];
    list.add(shapes[scene.bodies[physics::index_of(of.logged.ids[i])].shape], state.position_m,
             state.orientation);
  }
  list.say("body", of.labels);
  list.say("world", of.worlds);
  list.say("island", of.islands);
  return list.text(of.step, of.time_s);
}

std::string statics_text(LogReader& log, const scenarios::Scenario& scenario) {
  const Extent extent = extent_of(log, scenario.territory.grid.cell_size_m);
  SurfaceList list;
  std::vector<std::int64_t> numbers;
  for (const physics::StaticBody& body : scenario.scene.statics) {
    list.add(shared_corners(seen_static(body, scenario.scene, extent)), body.position_m,
             body.orientation);
    numbers.push_back(static_cast<std::int64_t>(numbers.size()));
  }
  list.say("static", numbers);
  return list.text(log.first_step(), static_cast<double>(log.first_step()) * scenario.scene.dt_s);
}

// Files of one kind, a step each, and the collection of them.
class VtkSeries {
 public:
  VtkSeries(std::string kind, OutputFolder& folder) : kind_(std::move(kind)), folder_(folder) {}

  void add(const VtkStep& of, const std::string& text) {
    std::string number = std::to_string(of.step);
    number.insert(0, number.size() < 6 ? 6 - number.size() : 0, '0');
    frames_.push_back({of.time_s, kind_ + "-" + number + ".vtp"});
    folder_.write(frames_.back().file, text);
  }
  void finish() { folder_.write(kind_ + ".pvd", vtk_collection(frames_)); }

 private:
  const std::string kind_;
  OutputFolder& folder_;
  std::vector<VtkFrame> frames_;
};

std::vector<SharedSurface> surfaces_of(const physics::SceneDescription& scene) {
  std::vector<SharedSurface> surfaces;
  for (const physics::Shape& shape : scene.shapes)
    surfaces.push_back(shared_corners(seen(shape, scene)));
  return surfaces;
}

std::vector<physics::ContactLoad> loads_with_point(const physics::SceneDescription& scene,
                                                   const physics::Geometry& geometry,
                                                   const LoggedStep& logged) {
  std::vector<physics::ContactLoad> loads =
      physics::contact_loads(scene, geometry, logged.ids, logged.states);
  std::erase_if(loads, [](const physics::ContactLoad& load) { return !load.point; });
  return loads;
}

}  // namespace

VtkCounts write_vtk(LogReader& log, const scenarios::Scenario& scenario, const VtkOptions& options,
                    OutputFolder& folder) {
  const physics::SceneDescription& scene = scenario.scene;
  const physics::Geometry geometry(scene);
  const std::vector<SharedSurface> shapes =
      options.surfaces ? surfaces_of(scene) : std::vector<SharedSurface>();
  models::TerritoryMap map =
      models::make_territory_map(scenario.territory, centres(scenario.initial), &scene);
  VtkSeries bodies("bodies", folder), contacts("contacts", folder), surfaces("surfaces", folder);
  VtkCounts counts;
  const std::int64_t last = log.last_states();
  for (std::int64_t step = log.first_step(); step <= last; ++step) {
    const LoggedStep logged = log.read_step(step);
    follow_changes(logged, map);
    const bool is_asked = (step - log.first_step()) % options.every == 0 || step == last;
    if (!logged.has_states || !is_asked) continue;
    require_numbers(log, logged);
    const VtkStep of = known_of(logged, log, scene, map);
    const std::vector<physics::ContactLoad> loads = loads_with_point(scene, geometry, logged);
    bodies.add(of, bodies_text(of));
    contacts.add(of, contacts_text_of(of, log, loads));
    if (options.surfaces) surfaces.add(of, surfaces_text(of, scene, shapes));
    ++counts.steps;
    counts.contacts += loads.size();
  }
  folder.write("statics.vtp", statics_text(log, scenario));
  for (VtkSeries* series : {&bodies, &contacts}) series->finish();
  if (options.surfaces) surfaces.finish();
  folder.complete();
  return counts;
}

}  // namespace soda::analysis
