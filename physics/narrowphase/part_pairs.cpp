#include "physics/narrowphase/part_pairs.hpp"

#include <algorithm>

namespace soda::physics {
namespace {

std::vector<Aabb> boxes_of_parts(const PlacedShape& s, double margin_m) {
  std::vector<Aabb> boxes;
  const auto add = [&](const CompiledShape& shape, const Pose& pose) {
    Aabb box = tight_aabb(shape, pose);
    box.min -= Vec3::Constant(margin_m);
    box.max += Vec3::Constant(margin_m);
    boxes.push_back(box);
  };
  if (s.shape.parts.empty()) add(s.shape, s.pose);
  for (const CompiledPart& p : s.shape.parts)
    add(*p.solid, {s.pose.rotation * p.pose.rotation, s.pose.to_world(p.pose.position)});
  return boxes;
}

bool is_endless(const CompiledShape& shape) {
  return shape.kind == ShapeKind::kMesh || shape.kind == ShapeKind::kHalfSpace;
}

}  // namespace

std::vector<PartPair> near_parts(const Solid& a, const Solid& b, double range_m) {
  std::vector<PartPair> pairs;
  const CompiledShape &sa = a.placed.shape, &sb = b.placed.shape;
  if (is_endless(sb) || part_count(sa) * part_count(sb) == 1) {
    for (std::uint32_t i = 0; i < part_count(sa); ++i) pairs.push_back({i, 0});
    return pairs;
  }
  const std::vector<Aabb> of_a = boxes_of_parts(a.placed, std::min(range_m, 1e300)),
                          of_b = boxes_of_parts(b.placed, 0.0);
  for (std::uint32_t i = 0; i < of_a.size(); ++i)
    for (std::uint32_t k = 0; k < of_b.size(); ++k)
      if (overlap(of_a[i], of_b[k])) pairs.push_back({i, k});
  return pairs;
}

void number_parts(const CompiledShape& b, PartPair parts, std::size_t begin,
                  std::vector<ContactManifold>& out) {
  const bool mesh = b.kind == ShapeKind::kMesh;
  const auto triangles = static_cast<std::uint32_t>(b.triangles.size());
  for (std::size_t m = begin; m < out.size(); ++m) {
    if (!mesh)
      out[m].part = parts.a * part_count(b) + parts.b;
    else
      out[m].part += parts.a * triangles * (out[m].part < kFirstEdgePart ? 1u : 3u);
  }
}

NumberedPart parts_of(const CompiledShape& b, std::uint32_t number) {
  if (b.kind != ShapeKind::kMesh) return {{number / part_count(b), number % part_count(b)}};
  const auto triangles = static_cast<std::uint32_t>(b.triangles.size());
  if (number < kFirstEdgePart) return {{number / triangles, 0}, number % triangles};
  return {{(number - kFirstEdgePart) / (3 * triangles), 0}};
}

bool meets_in_parts(const SceneDescription& scene, BodyId a, BodyId b) {
  const auto shape = [&scene](BodyId id) -> const Shape& {
    return scene.shapes[is_static(id) ? scene.statics[static_index_of(id)].shape
                                      : scene.bodies[index_of(id)].shape];
  };
  return std::holds_alternative<Compound>(shape(a)) || std::holds_alternative<Compound>(shape(b)) ||
         std::holds_alternative<TriangleMesh>(shape(b));
}

KernelCounts most_tests(const SceneDescription& scene, const Shape& a, const Shape& b) {
  KernelCounts counts{};
  const auto solids_of = [&scene](const Shape& shape) {
    std::vector<const Shape*> solids;
    const auto* compound = std::get_if<Compound>(&shape);
    if (!compound) return std::vector<const Shape*>{&shape};
    for (const CompoundPart& part : compound->parts) solids.push_back(&scene.shapes[part.shape]);
    return solids;
  };
  const std::vector<const Shape*> of_b = solids_of(b);
  for (const Shape* x : solids_of(a))
    for (const Shape* y : of_b) ++counts[static_cast<std::size_t>(kernel_for(*x, *y))];
  return counts;
}

}  // namespace soda::physics
