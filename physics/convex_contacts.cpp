#include "physics/convex_contacts.hpp"

#include <cmath>

namespace soda::physics {
namespace {

// The derivative of the projection: symmetric, between zero and one.
Mat3 stiffness(const ConvexPoint& point, const PointResponse& response) {
  if (response.mode == ContactMode::kStick) return Mat3::Identity();
  const Vec3& n = point.normal;
  const Vec3& t = response.along;
  const Vec3 edge =
      (n + t * point.friction) * (1.0 / std::sqrt(1.0 + point.friction * point.friction));
  const Vec3 across = n.cross(t);
  Mat3 out;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      out(i, j) = edge[i] * edge[j] + response.aside * (across[i] * across[j]);
    }
  }
  return out;
}

// Every column of `m` crossed with v: -[v]x m.
Mat3 crossed_columns(const Vec3& v, const Mat3& m) {
  Mat3 out;
  for (int c = 0; c < 3; ++c) {
    out(0, c) = m(1, c) * v.z() - m(2, c) * v.y();
    out(1, c) = m(2, c) * v.x() - m(0, c) * v.z();
    out(2, c) = m(0, c) * v.y() - m(1, c) * v.x();
  }
  return out;
}

// Adds sign * [G, -G [c]x; [r]x G, -[r]x G [c]x] for the arms r of the row and c of the column.
void add_block(const Mat3& stiff, const Vec3& arm_row, const Vec3& arm_column, double sign,
               Block& out) {
  // -G [c]x is the transpose of [c]x G, as G is symmetric.
  const Mat3 turned_column = -crossed_columns(arm_column, stiff).transpose();
  const Mat3 turned_row = -crossed_columns(arm_row, stiff);
  const Mat3 both = -crossed_columns(arm_row, turned_column);
  for (int c = 0; c < 3; ++c) {
    for (int r = 0; r < 3; ++r) {
      out[6 * c + r] += sign * stiff(r, c);
      out[6 * (c + 3) + r] += sign * turned_column(r, c);
      out[6 * c + r + 3] += sign * turned_row(r, c);
      out[6 * (c + 3) + r + 3] += sign * both(r, c);
    }
  }
}

void add_mass(const ConvexBody& body, Block& out) {
  for (int i = 0; i < 3; ++i) {
    out[7 * i] += body.mass_kg;
    for (int j = 0; j < 3; ++j) out[6 * (i + 3) + j + 3] += body.inertia_kg_m2(j, i);
  }
}

}  // namespace

Mat3 inverse_of_symmetric(const Mat3& m) {
  const double c00 = m(1, 1) * m(2, 2) - m(1, 2) * m(1, 2);
  const double c01 = m(0, 2) * m(1, 2) - m(0, 1) * m(2, 2);
  const double c02 = m(0, 1) * m(1, 2) - m(0, 2) * m(1, 1);
  const double inverse = 1.0 / (m(0, 0) * c00 + m(0, 1) * c01 + m(0, 2) * c02);
  Mat3 out;
  out(0, 0) = c00 * inverse;
  out(0, 1) = out(1, 0) = c01 * inverse;
  out(0, 2) = out(2, 0) = c02 * inverse;
  out(1, 1) = (m(0, 0) * m(2, 2) - m(0, 2) * m(0, 2)) * inverse;
  out(1, 2) = out(2, 1) = (m(0, 1) * m(0, 2) - m(0, 0) * m(1, 2)) * inverse;
  out(2, 2) = (m(0, 0) * m(1, 1) - m(0, 1) * m(0, 1)) * inverse;
  return out;
}

PointResponse respond(const ConvexPoint& p, double compliance, const Vec3& velocity) {
  const Vec3 y = p.start_newton_s + (p.target_m_s - velocity) * (1.0 / compliance);
  const double normal = y.dot(p.normal);
  const Vec3 tangential = y - p.normal * normal;
  const double size = tangential.norm();
  PointResponse out;
  if (normal + p.friction * size <= 0.0) return out;
  if (size <= p.friction * normal) {
    out.mode = ContactMode::kStick;
    out.impulse_newton_s = y;
    return out;
  }
  out.mode = ContactMode::kSlide;
  const double pressing = (normal + p.friction * size) / (1.0 + p.friction * p.friction);
  out.along = tangential * (1.0 / size);
  out.impulse_newton_s = p.normal * pressing + out.along * (p.friction * pressing);
  out.aside = p.friction * pressing / size;
  return out;
}

Vec3 relative_velocity(const ConvexPoint& p, std::span<const Twist> twists) {
  const Twist& a = twists[p.a];
  Vec3 velocity = -(a.linear + a.angular.cross(p.arm_a));
  if (p.b < twists.size()) {
    const Twist& b = twists[p.b];
    velocity += b.linear + b.angular.cross(p.arm_b);
  }
  return velocity;
}

void gradient(const ConvexContacts& problem, std::span<const Twist> twists,
              std::span<const PointResponse> responses, std::vector<Twist>& out) {
  out.resize(twists.size());
  for (std::size_t i = 0; i < twists.size(); ++i) {
    const ConvexBody& body = problem.bodies[i];
    out[i].linear = (twists[i].linear - problem.free[i].linear) * body.mass_kg;
    out[i].angular = body.inertia_kg_m2 * Vec3(twists[i].angular - problem.free[i].angular);
  }
  for (std::size_t i = 0; i < responses.size(); ++i) {
    if (responses[i].mode == ContactMode::kOpen) continue;
    const ConvexPoint& p = problem.points[i];
    const Vec3& impulse = responses[i].impulse_newton_s;
    out[p.a].linear += impulse;
    out[p.a].angular += p.arm_a.cross(impulse);
    if (p.b >= twists.size()) continue;
    out[p.b].linear -= impulse;
    out[p.b].angular -= p.arm_b.cross(impulse);
  }
}

void assemble(const ConvexContacts& problem, const Elimination& plan,
              std::span<const PointResponse> responses, std::vector<Block>& out) {
  out.assign(plan.rows.size(), Block{});
  const std::uint32_t count = static_cast<std::uint32_t>(problem.bodies.size());
  for (std::uint32_t i = 0; i < count; ++i) add_mass(problem.bodies[i], out[plan.block_of(i, i)]);
  const double scale = 1.0 / problem.compliance_1_kg;
  for (std::size_t i = 0; i < responses.size(); ++i) {
    if (responses[i].mode == ContactMode::kOpen) continue;
    const ConvexPoint& p = problem.points[i];
    const Mat3 stiff = stiffness(p, responses[i]) * scale;
    add_block(stiff, p.arm_a, p.arm_a, 1.0, out[plan.block_of(p.a, p.a)]);
    if (p.b >= count) continue;
    add_block(stiff, p.arm_b, p.arm_b, 1.0, out[plan.block_of(p.b, p.b)]);
    // The row is the body that is eliminated later.
    const bool row_is_b = plan.place_of[p.b] > plan.place_of[p.a];
    add_block(stiff, row_is_b ? p.arm_b : p.arm_a, row_is_b ? p.arm_a : p.arm_b, -1.0,
              out[plan.block_of(p.a, p.b)]);
  }
}

}  // namespace soda::physics
