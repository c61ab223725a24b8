#include "scenarios/placed_boxes.hpp"

namespace soda::scenarios {
namespace {

using physics::Aabb;
using physics::Vec3;

Aabb box_around(const physics::TriangleMesh& mesh, const physics::Pose& pose) {
  const Vec3 first = pose.to_world(mesh.vertices_m.front());
  Aabb box{first, first};
  for (const Vec3& vertex : mesh.vertices_m) {
    const Vec3 at = pose.to_world(vertex);
    box = {box.min.cwiseMin(at), box.max.cwiseMax(at)};
  }
  return box;
}

}  // namespace

physics::Pose pose_of(const physics::BodyState& state) {
  return {state.orientation.toRotationMatrix(), state.position_m};
}

physics::Pose pose_of(const physics::StaticBody& body) {
  return {body.orientation.toRotationMatrix(), body.position_m};
}

physics::Aabb joined(const Aabb& a, const Aabb& b) {
  return {a.min.cwiseMin(b.min), a.max.cwiseMax(b.max)};
}

double longest_edge_m(const Aabb& box) { return (box.max - box.min).maxCoeff(); }

PlacedBoxes placed_boxes(const Scenario& scenario) {
  const physics::SceneDescription& scene = scenario.scene;
  PlacedBoxes boxes;
  for (const physics::Shape& shape : scene.shapes) {
    const bool mesh = std::holds_alternative<physics::TriangleMesh>(shape);
    boxes.shapes.push_back(mesh ? physics::CompiledShape{} : physics::compile(shape, scene.shapes));
  }
  boxes.bodies.reserve(scene.bodies.size());
  for (std::size_t i = 0; i < scene.bodies.size(); ++i)
    boxes.bodies.push_back(
        physics::tight_aabb(boxes.shapes[scene.bodies[i].shape], pose_of(scenario.initial[i])));
  for (const physics::StaticBody& body : scene.statics) {
    const physics::Shape& shape = scene.shapes[body.shape];
    if (std::holds_alternative<physics::HalfSpace>(shape))
      boxes.statics.emplace_back();
    else if (const auto* mesh = std::get_if<physics::TriangleMesh>(&shape))
      boxes.statics.emplace_back(box_around(*mesh, pose_of(body)));
    else
      boxes.statics.emplace_back(physics::tight_aabb(boxes.shapes[body.shape], pose_of(body)));
  }
  return boxes;
}

}  // namespace soda::scenarios
