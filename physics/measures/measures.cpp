#include "physics/measures/measures.hpp"

#include <xxhash.h>

#include <algorithm>
#include <bit>
#include <memory>
#include <optional>
#include <vector>

#include "physics/forces/forces.hpp"

namespace soda::physics {
namespace {

// Visits every named field of a state in one fixed order, as its 64 bits. Returns false as soon as
// the visitor does.
template <typename Visit>
bool visit_fields(const BodyState& s, Visit visit) {
  static constexpr const char* kPosition[] = {"position_m.x", "position_m.y", "position_m.z"};
  static constexpr const char* kLinear[] = {"linear_velocity_m_s.x", "linear_velocity_m_s.y",
                                            "linear_velocity_m_s.z"};
  static constexpr const char* kAngular[] = {"angular_velocity_rad_s.x", "angular_velocity_rad_s.y",
                                             "angular_velocity_rad_s.z"};
  static constexpr const char* kFriction[] = {"impulses.friction_newton_s.x",
                                              "impulses.friction_newton_s.y",
                                              "impulses.friction_newton_s.z"};
  const auto real = [&](const char* name, double v) {
    return visit(name, v, std::bit_cast<std::uint64_t>(v));
  };
  const auto integer = [&](const char* name, std::uint64_t v) {
    return visit(name, static_cast<double>(v), v);
  };
  const auto vector = [&](const char* const(&names)[3], const Vec3& v) {
    return real(names[0], v.x()) && real(names[1], v.y()) && real(names[2], v.z());
  };
  const bool same =
      vector(kPosition, s.position_m) && real("orientation.w", s.orientation.w()) &&
      real("orientation.x", s.orientation.x()) && real("orientation.y", s.orientation.y()) &&
      real("orientation.z", s.orientation.z()) && vector(kLinear, s.linear_velocity_m_s) &&
      vector(kAngular, s.angular_velocity_rad_s) && integer("impulses.size", s.impulses.size());
  if (!same) return false;
  for (const ContactImpulse& c : s.impulses) {
    if (!(integer("impulses.other", index_of(c.other)) && integer("impulses.part", c.part) &&
          integer("impulses.feature", c.feature) &&
          real("impulses.normal_newton_s", c.normal_newton_s) &&
          vector(kFriction, c.friction_newton_s))) {
      return false;
    }
  }
  if (s.broken_joints.empty()) return true;  // digests of what cannot break have nothing of it
  if (!integer("broken_joints.size", s.broken_joints.size())) return false;
  for (const std::uint32_t joint : s.broken_joints)
    if (!integer("broken_joints", joint)) return false;
  return true;
}

constexpr std::size_t kFixedFields = 14;
constexpr std::size_t kFieldsPerImpulse = 7;
// As many as a cache holds at hand.
constexpr std::size_t kHashedWords = 1024;

// How many fields are visited.
std::size_t field_count(const BodyState& s) {
  const std::size_t broken = s.broken_joints.empty() ? 0 : 1 + s.broken_joints.size();
  return kFixedFields + kFieldsPerImpulse * s.impulses.size() + broken;
}

// Of the springs whose bodies are all there.
double spring_energy_joule(const SceneDescription& scene, std::span<const BodyId> ids,
                           std::span<const BodyState> states) {
  double sum = 0.0;
  for (const Joint& joint : scene.joints) {
    if (joint.kind != JointKind::kSpring) continue;
    bool broken = false;
    const auto anchor = [&](BodyId id, const Vec3& local) -> std::optional<Vec3> {
      if (is_static(id)) return local;
      const auto at = std::lower_bound(ids.begin(), ids.end(), id);
      if (at == ids.end() || *at != id) return std::nullopt;
      const BodyState& state = states[static_cast<std::size_t>(at - ids.begin())];
      broken = broken || is_broken(joint, state);
      return state.position_m + state.orientation * local;
    };
    const std::optional<Vec3> a = anchor(joint.a, joint.anchor_a_m);
    const std::optional<Vec3> b = anchor(joint.b, joint.anchor_b_m);
    if (!a || !b || broken) continue;
    const double stretch = (*b - *a).norm() - joint.length_m;
    sum += 0.5 * joint.stiffness_newton_m * stretch * stretch;
  }
  return sum;
}

}  // namespace

Mechanics measure(const SceneDescription& scene, std::span<const BodyId> ids,
                  std::span<const BodyState> states) {
  Mechanics sum;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const BodyParams& params = scene.bodies[index_of(ids[i])];
    if (params.kinematic) continue;
    const BodyState& s = states[i];
    const Mat3 rotation = s.orientation.toRotationMatrix();
    const Vec3 angular_velocity_local = rotation.transpose() * s.angular_velocity_rad_s;
    const Vec3 angular_momentum_local = params.inertia_local_kg_m2 * angular_velocity_local;
    const Vec3 momentum = params.mass_kg * s.linear_velocity_m_s;
    sum.kinetic_energy_joule += 0.5 * (momentum.dot(s.linear_velocity_m_s) +
                                       angular_momentum_local.dot(angular_velocity_local));
    sum.potential_energy_joule -= params.mass_kg * field_of(scene, params).dot(s.position_m);
    sum.linear_momentum_newton_s += momentum;
    sum.angular_momentum_newton_m_s += s.position_m.cross(momentum);
    sum.angular_momentum_newton_m_s += rotation * angular_momentum_local;
    sum.momentum_scale_newton_s += momentum.norm();
  }
  sum.potential_energy_joule += spring_energy_joule(scene, ids, states);
  return sum;
}

DriveImpulse drive_impulse(const SceneDescription& scene, std::span<const BodyId> ids,
                           std::span<const BodyState> states) {
  DriveImpulse total;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const BodyParams& params = scene.bodies[index_of(ids[i])];
    Vec3 impulse = params.own_field_m_s2 * (params.mass_kg * scene.dt_s);
    if (is_pushed(params)) impulse += push_impulse_newton_s(scene, scene.dt_s, ids[i], states[i]);
    total.sum_newton_s += impulse;
    total.scale_newton_s += impulse.norm();
  }
  return total;
}

std::uint64_t digest(std::span<const BodyId> ids, std::span<const BodyState> states) {
  static_assert(std::endian::native == std::endian::little, "digests are little-endian");
  const std::unique_ptr<XXH3_state_t, void (*)(XXH3_state_t*)> hash(
      XXH3_createState(), [](XXH3_state_t* state) { XXH3_freeState(state); });
  XXH3_64bits_reset(hash.get());
  std::vector<std::uint64_t>
      words;  // of some bodies: a call for each would cost more than its hash
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const std::size_t begin = words.size();
    words.resize(begin + 1 + field_count(states[i]));
    std::uint64_t* end = words.data() + begin;
    *end++ = index_of(ids[i]);
    visit_fields(states[i], [&](const char*, double, std::uint64_t bits) {
      *end++ = bits;
      return true;
    });
    if (words.size() < kHashedWords && i + 1 < ids.size()) continue;
    XXH3_64bits_update(hash.get(), words.data(), words.size() * sizeof(std::uint64_t));
    words.clear();
  }
  return XXH3_64bits_digest(hash.get());
}

bool identical(const BodyState& a, const BodyState& b) {
  const auto same = [](double x, double y) {
    return std::bit_cast<std::uint64_t>(x) == std::bit_cast<std::uint64_t>(y);
  };
  const auto same3 = [&](const Vec3& x, const Vec3& y) {
    return same(x.x(), y.x()) && same(x.y(), y.y()) && same(x.z(), y.z());
  };
  const Quat &p = a.orientation, &q = b.orientation;
  if (!(same3(a.position_m, b.position_m) && same(p.w(), q.w()) && same(p.x(), q.x()) &&
        same(p.y(), q.y()) && same(p.z(), q.z()) &&
        same3(a.linear_velocity_m_s, b.linear_velocity_m_s) &&
        same3(a.angular_velocity_rad_s, b.angular_velocity_rad_s) &&
        a.impulses.size() == b.impulses.size() && a.broken_joints == b.broken_joints)) {
    return false;
  }
  for (std::size_t i = 0; i < a.impulses.size(); ++i) {
    const ContactImpulse &x = a.impulses[i], &y = b.impulses[i];
    if (!(x.other == y.other && x.part == y.part && x.feature == y.feature &&
          same(x.normal_newton_s, y.normal_newton_s) &&
          same3(x.friction_newton_s, y.friction_newton_s))) {
      return false;
    }
  }
  return true;
}

FieldDifference first_difference(const BodyState& a, const BodyState& b) {
  struct Field {
    double value;
    std::uint64_t bits;
  };
  std::vector<Field> fields;
  fields.reserve(field_count(a));
  visit_fields(a, [&](const char*, double value, std::uint64_t bits) {
    fields.push_back({value, bits});
    return true;
  });
  // The number of impulses is itself a field that stands before them, so the walks agree in length
  // up to the first difference, or the joints that are broken in one of them only.
  FieldDifference difference;
  std::size_t next = 0;
  const bool all = visit_fields(b, [&](const char* name, double value, std::uint64_t bits) {
    const Field field = next < fields.size() ? fields[next] : Field{0.0, 0};
    ++next;
    if (field.bits == bits) return true;
    difference = {name, field.value, value};
    return false;
  });
  if (all && next < fields.size()) difference = {"broken_joints.size", fields[next].value, 0.0};
  return difference;
}

}  // namespace soda::physics
