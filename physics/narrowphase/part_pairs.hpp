// Compounds: which of their convex solids can meet, and how their contacts are told apart.
#pragma once

#include <array>
#include <vector>

#include "physics/narrowphase/separation.hpp"

namespace soda::physics {

// Parts of two compounds; 0 of what is none.
struct PartPair {
  std::uint32_t a = 0, b = 0;
};

inline std::uint32_t part_count(const CompiledShape& shape) {
  return shape.parts.empty() ? 1u : static_cast<std::uint32_t>(shape.parts.size());
}

// A part where its compound is; what is no compound itself.
inline Solid part_of(const GeometryImpl& impl, const Solid& whole, std::uint32_t part) {
  if (whole.placed.shape.parts.empty()) return whole;
  const CompiledPart& p = whole.placed.shape.parts[part];
  const ShapeGeometry& solid = impl.shapes[p.shape];
  const Pose& pose = whole.placed.pose;
  return {solid, {solid.shape, {pose.rotation * p.pose.rotation, pose.to_world(p.pose.position)}}};
}

// Of one of which at least is a compound: parts whose boxes come nearer to each other than the
// range, ascending. Meshes and halfspaces are near everything.
std::vector<PartPair> near_parts(const Solid& a, const Solid& b, double range_m);

// A manifold's part is, of two parts of solids, their number among all pairs of parts. Triangles
// and edges of a mesh are counted anew for each part of a compound: faces below kFirstEdgePart,
// edges from there on.
inline constexpr std::uint32_t kFirstEdgePart = 0x40000000u;
// The most triangles that a mesh can have which compounds of so many parts meet.
inline constexpr std::size_t most_triangles(std::size_t parts) {
  return kFirstEdgePart / 3 / parts;
}

// Numbers manifolds from `begin` on, which are those of one pair of parts that knows of no others.
void number_parts(const CompiledShape& b, PartPair parts, std::size_t begin,
                  std::vector<ContactManifold>& out);
// Of one of these manifolds, the parts; `face`: of a mesh, its group of triangles, or kNone.
struct NumberedPart {
  PartPair parts;
  std::uint32_t face = kNone;
};
NumberedPart parts_of(const CompiledShape& b, std::uint32_t number);

// Whether a pair meets in several parts: one is a compound or a mesh.
bool meets_in_parts(const SceneDescription& scene, BodyId a, BodyId b);

// How many tests of each kernel two shapes of a scene take at most.
using KernelCounts = std::array<std::uint32_t, static_cast<std::size_t>(ShapeKernel::kCount)>;
KernelCounts most_tests(const SceneDescription& scene, const Shape& a, const Shape& b);

}  // namespace soda::physics
