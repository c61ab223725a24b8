// Identities and the vector types of the physics layer.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>

namespace soda::physics {

// World frame unless a name ends in _local; SI units. Fixed-size types only: Eigen's dynamic-size
// reductions may give other bits on other instruction sets.
using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using Quat = Eigen::Quaterniond;

// A dynamic body: the index of its description in SceneDescription::bodies. Static bodies live in
// the same number space above kFirstStatic, so that (lower, higher) orders every pair, with the
// dynamic body first.
enum class BodyId : std::uint32_t {};
inline constexpr std::uint32_t kFirstStatic = 0x80000000u;

constexpr std::uint32_t index_of(BodyId id) { return static_cast<std::uint32_t>(id); }
constexpr bool is_static(BodyId id) { return index_of(id) >= kFirstStatic; }
constexpr BodyId static_id(std::uint32_t static_index) {
  return static_cast<BodyId>(kFirstStatic + static_index);
}
constexpr std::uint32_t static_index_of(BodyId id) { return index_of(id) - kFirstStatic; }

// Axis-aligned box, closed: boxes that share a face overlap.
struct Aabb {
  Vec3 min = Vec3::Zero();
  Vec3 max = Vec3::Zero();
};

// Lexicographic.
inline bool comes_before(const Vec3& a, const Vec3& b) {
  for (int i = 0; i < 3; ++i) {
    if (a[i] != b[i]) return a[i] < b[i];
  }
  return false;
}

inline bool identical(const Aabb& a, const Aabb& b) {
  for (int axis = 0; axis < 3; ++axis)
    if (a.min[axis] != b.min[axis] || a.max[axis] != b.max[axis]) return false;
  return true;
}

inline bool overlap(const Aabb& a, const Aabb& b) {
  return a.min.x() <= b.max.x() && b.min.x() <= a.max.x() && a.min.y() <= b.max.y() &&
         b.min.y() <= a.max.y() && a.min.z() <= b.max.z() && b.min.z() <= a.max.z();
}

}  // namespace soda::physics
