// Shapes as the file gives them, made into physics shapes, each kept once.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "physics/model/scene.hpp"
#include "physics/shapes/mass_properties.hpp"
#include "scenarios/document.hpp"
#include "scenarios/faults.hpp"
#include "scenarios/mesh_file.hpp"

namespace soda::scenarios {

// A shape in the scene's list.
struct PlacedShape {
  std::uint32_t index = 0;         // into SceneDescription::shapes
  Vec3 center_m = Vec3::Zero();    // centre of mass in the frame of the file; the new origin
  Vec3 size_m = Vec3::Zero();      // of the local axis-aligned box; solid shapes only
  double bounding_radius_m = 0.0;  // about the centre of mass; solid shapes only
  physics::MassProperties mass;    // density 1 kg/m^3, about the centre of mass
};

// Equal shapes share one entry, so that compiled geometry is shared too. The key is the kind and
// all numbers.
using ShapeIndex = std::map<std::vector<double>, PlacedShape>;

// Adds the shape unless it is there. Nothing, and perhaps a fault, if the file's shape is faulty.
std::optional<PlacedShape> place_shape(const SolidShapeSpec& spec,
                                       std::vector<physics::Shape>& shapes, ShapeIndex& index,
                                       FaultList& faults);
// The same for a body, whose centre of mass may be elsewhere than in the shape's.
std::optional<PlacedShape> place_body_shape(const SolidSpec& spec,
                                            std::vector<physics::Shape>& shapes, ShapeIndex& index,
                                            FaultList& faults);
std::optional<PlacedShape> place_shape(const StaticShapeSpec& spec, const MeshFiles& files,
                                       std::vector<physics::Shape>& shapes, ShapeIndex& index,
                                       FaultList& faults);

}  // namespace soda::scenarios
