#include "analysis/scaling/side_by_side.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace soda::analysis {
namespace {

using physics::BodyId;
using physics::Vec3;

const physics::HalfSpace* half_space(const physics::SceneDescription& scene,
                                     const physics::StaticBody& body) {
  return std::get_if<physics::HalfSpace>(&scene.shapes[body.shape]);
}

// Along which no halfspace rises: moved that way, each is what it was.
std::optional<int> free_axis(const physics::SceneDescription& scene) {
  constexpr double kRounding = 1e-12;
  for (int axis = 0; axis < 3; ++axis) {
    const bool is_free = std::ranges::all_of(scene.statics, [&](const physics::StaticBody& body) {
      const physics::HalfSpace* const space = half_space(scene, body);
      return space == nullptr || std::abs((body.orientation * space->normal)[axis]) < kRounding;
    });
    // Bodies fall out of copies that stand on each other.
    if (is_free && scene.gravity_m_s2[axis] == 0.0) return axis;
  }
  return std::nullopt;
}

template <class Items>
std::uint32_t labels_end(const Items& items) {
  std::uint32_t end = 0;
  for (const auto& item : items) end = std::max(end, item.label + 1);
  return end;
}

class Copier {
 public:
  Copier(const scenarios::Scenario& one, scenarios::Scenario& all)
      : scene_(one.scene),
        one_(one),
        all_(all),
        body_labels_(labels_end(one.scene.bodies)),
        joint_labels_(labels_end(one.scene.joints)) {}

  void add(std::uint32_t copy, const Vec3& shift_m) {
    const auto bodies = static_cast<std::uint32_t>(all_.scene.bodies.size());
    const auto drives = static_cast<std::uint32_t>(all_.scene.drives.size());
    for (physics::Drive drive : scene_.drives) {
      if (drive.lane)
        for (Vec3& point : drive.lane->way_points_m) point += shift_m;
      all_.scene.drives.push_back(std::move(drive));
    }
    for (physics::BodyParams body : scene_.bodies) {
      body.label += copy * body_labels_;
      if (body.drive != physics::kNoDrive) body.drive += drives;
      all_.scene.bodies.push_back(std::move(body));
    }
    for (physics::BodyState state : one_.initial) {
      state.position_m += shift_m;
      all_.initial.push_back(std::move(state));
    }
    for (physics::StaticBody body : scene_.statics) {
      if (half_space(scene_, body) != nullptr) continue;
      body.position_m += shift_m;
      all_.scene.statics.push_back(std::move(body));
    }
    add_joints(copy, bodies, shift_m);
  }

 private:
  void add_joints(std::uint32_t copy, std::uint32_t bodies, const Vec3& shift_m) {
    for (physics::Joint joint : scene_.joints) {
      joint.label += copy * joint_labels_;
      joint.a = BodyId{physics::index_of(joint.a) + bodies};
      if (joint.b == physics::kWorldBody)
        joint.anchor_b_m += shift_m;
      else
        joint.b = BodyId{physics::index_of(joint.b) + bodies};
      all_.scene.joints.push_back(std::move(joint));
    }
  }

  const physics::SceneDescription& scene_;
  const scenarios::Scenario& one_;
  scenarios::Scenario& all_;
  const std::uint32_t body_labels_, joint_labels_;
};

}  // namespace

std::string why_single(const scenarios::Scenario& scenario) {
  if (scenario.run.inputs.any()) return "it has user input";
  if (!free_axis(scenario.scene))
    return "no direction is free: halfspaces rise, or bodies fall, along each axis";
  return {};
}

scenarios::Scenario side_by_side(const scenarios::Scenario& scenario, std::uint32_t copies) {
  scenarios::Scenario all = scenario;
  const int axis = *free_axis(scenario.scene);
  models::Grid& grid = all.territory.grid;
  const double width_m = grid.cell_size_m * grid.cells[static_cast<std::size_t>(axis)];
  grid.cells[static_cast<std::size_t>(axis)] *= static_cast<std::int32_t>(copies);
  all.territory.worlds = copies;
  all.territory.map = models::MapKind::kBlocks;
  all.scene.drives.clear();
  all.scene.bodies.clear();
  all.scene.joints.clear();
  all.initial.clear();
  std::erase_if(all.scene.statics, [&scenario](const physics::StaticBody& body) {
    return half_space(scenario.scene, body) == nullptr;
  });
  Copier copier(scenario, all);
  for (std::uint32_t copy = 0; copy < copies; ++copy)
    copier.add(copy, width_m * copy * Vec3::Unit(axis));
  return all;
}

}  // namespace soda::analysis
