#include "analysis/search/fuzz_scene.hpp"

#include <algorithm>
#include <cmath>

#include "scenarios/random.hpp"

namespace soda::analysis {
namespace {

using physics::Quat;
using physics::Vec3;

constexpr double kLeastSize_m = 1e-3, kMostSize_m = 1e3;

// What one seed draws, piece by piece.
class Draw {
 public:
  Draw(std::uint64_t seed, std::int64_t steps) : random_(scenarios::make_stream(seed, 1)) {
    scene_.seed = seed;
    scene_.steps = steps;
  }

  FuzzScene scene(FuzzJoints joints) {
    constexpr double kSteps_s[] = {0.1, 1.0 / 60.0, 1.0 / 60.0, 1.0 / 240.0, 1e-3, 1e-4};
    scene_.time_step_s = kSteps_s[below(6)];
    scene_.gravity_m_s2 = chance(5) ? 0.0 : 9.81;
    size_m_ = powers(kLeastSize_m, kMostSize_m);
    mass_kg_ = powers(1e-9, 1e9);
    wild_sizes_ = chance(3);
    wild_masses_ = chance(3);
    crowded_ = chance(2);
    const std::uint32_t bodies = 1 + below(12);
    for (std::uint32_t id = 0; id < bodies; ++id) scene_.bodies.push_back(body(id, bodies));
    add_statics();
    if (joints != FuzzJoints::kNone) add_joints(joints);
    return scene_;
  }

 private:
  std::uint32_t below(std::uint32_t bound) {
    return static_cast<std::uint32_t>(scenarios::next_bits(random_) % bound);
  }
  bool chance(std::uint32_t one_in) { return below(one_in) == 0; }
  double between(double least, double most) { return scenarios::uniform(random_, least, most); }
  // Evenly in the logarithm; which bits libm gives does not matter, as the text says them all.
  double powers(double least, double most) {
    return least * std::pow(most / least, scenarios::uniform_unit(random_));
  }
  Vec3 direction() {
    const Vec3 v = scenarios::uniform_in_ball(random_);
    return v.norm() > 1e-3 ? Vec3(v.normalized()) : Vec3(Vec3::UnitX());
  }

  double size() {
    const double size =
        wild_sizes_ ? powers(kLeastSize_m, kMostSize_m) : size_m_ * powers(0.25, 4.0);
    return std::clamp(size, kLeastSize_m, kMostSize_m);
  }

  FuzzShape shape(std::uint32_t kinds) {
    FuzzShape shape;
    shape.kind = static_cast<FuzzShapeKind>(below(kinds));
    const double s = size();
    const double flat = chance(4) ? 20.0 : 2.0;
    for (int i = 0; i < 3; ++i)
      shape.size_m[i] = std::clamp(s * powers(1.0 / flat, 1.0), kLeastSize_m, kMostSize_m);
    if (shape.kind == FuzzShapeKind::kHull) {
      const std::uint32_t count = 4 + below(12);
      for (std::uint32_t i = 0; i < count; ++i)
        shape.points_m.push_back(
            shape.size_m.cwiseProduct(0.5 * scenarios::uniform_in_ball(random_)));
      stretch_to_least(shape.points_m);
    }
    return shape;
  }

  // Points can lie closer together than the size that they are scattered over.
  static void stretch_to_least(std::vector<Vec3>& points) {
    constexpr double kRounding = 1e-9;
    for (int axis = 0; axis < 3; ++axis) {
      double low = points.front()[axis], high = low;
      for (const Vec3& point : points) {
        low = std::min(low, point[axis]);
        high = std::max(high, point[axis]);
      }
      if (high - low >= kLeastSize_m) continue;
      for (Vec3& point : points) point[axis] *= (1.0 + kRounding) * kLeastSize_m / (high - low);
    }
  }

  void surface(FuzzStatic& thing) {
    thing.friction = chance(3) ? 0.0 : between(0.0, 2.0);
    thing.restitution = chance(2) ? 0.0 : chance(3) ? 1.0 : between(0.0, 1.0);
  }

  FuzzBody body(std::uint32_t id, std::uint32_t bodies) {
    FuzzBody body;
    body.id = id;
    body.shape = shape(5);
    surface(body);
    body.mass_kg =
        wild_masses_ ? powers(1e-9, 1e9) : std::clamp(mass_kg_ * powers(0.1, 10.0), 1e-9, 1e9);
    const double room = size_m_ * (crowded_ ? 0.5 : 2.0) * std::cbrt(static_cast<double>(bodies));
    body.position_m = room * scenarios::uniform_in_ball(random_);
    body.position_m.z() = std::abs(body.position_m.z());
    if (!chance(4)) body.orientation = scenarios::uniform_rotation(random_);
    const double s = body.shape.size_m.maxCoeff();
    if (!chance(3)) body.velocity_m_s = std::min(1e3, s * powers(0.01, 100.0)) * direction();
    if (!chance(3)) body.spin_rad_s = powers(0.01, 100.0) * direction();
    return body;
  }

  // Solid below z = 0, somewhat tilted or not; every body's centre is above that.
  void add_floor() {
    FuzzStatic floor;
    floor.shape.kind = FuzzShapeKind::kHalfSpace;
    surface(floor);
    scene_.statics.push_back(floor);
  }

  void add_mesh() {
    constexpr int kSide = 4;
    FuzzStatic ground;
    ground.shape.kind = FuzzShapeKind::kMesh;
    surface(ground);
    const double step = 2.0 * size_m_;
    for (int x = 0; x < kSide; ++x)
      for (int y = 0; y < kSide; ++y)
        ground.shape.points_m.push_back(Vec3((x - 0.5 * (kSide - 1)) * step,
                                             (y - 0.5 * (kSide - 1)) * step,
                                             between(-0.5, 0.0) * step));
    for (std::uint32_t x = 0; x + 1 < kSide; ++x)
      for (std::uint32_t y = 0; y + 1 < kSide; ++y) {
        const std::uint32_t at = x * kSide + y;
        ground.shape.triangles.push_back({at, at + kSide, at + 1});
        ground.shape.triangles.push_back({at + 1, at + kSide, at + kSide + 1});
      }
    scene_.statics.push_back(ground);
  }

  void add_obstacle() {
    FuzzStatic obstacle;
    obstacle.shape = shape(5);
    surface(obstacle);
    obstacle.position_m = 2.0 * size_m_ * scenarios::uniform_in_ball(random_);
    if (!chance(2)) obstacle.orientation = scenarios::uniform_rotation(random_);
    scene_.statics.push_back(obstacle);
  }

  void add_statics() {
    if (!chance(3)) add_floor();
    if (chance(4)) add_mesh();
    for (std::uint32_t i = below(3); i > 0; --i) add_obstacle();
  }

  // Each body may hang on an earlier one, or on the world, and sometimes twice: then in a loop, or
  // held more than once.
  void add_joints(FuzzJoints kind) {
    const auto add = [&](const FuzzBody& body) {
      scene_.joints.push_back(kind == FuzzJoints::kRigid ? joint(body) : spring(body));
    };
    for (const FuzzBody& body : scene_.bodies) {
      if (chance(2)) continue;
      add(body);
      if (chance(5)) add(body);
    }
  }

  // Of a body and an earlier one or the world, from its centre or beside it.
  FuzzJoint spring(const FuzzBody& body) {
    constexpr double kMost = 1e15;  // that a scenario may say
    FuzzJoint joint;
    joint.type = "spring";
    joint.body = body.id;
    joint.other_anchor_m = body.position_m + size_m_ * direction();
    double mass = body.mass_kg;
    if (body.id > 0 && !chance(3)) {
      joint.other_body = below(body.id);
      const FuzzBody& other = scene_.bodies[*joint.other_body];
      joint.other_anchor_m = other.position_m;
      mass = std::min(mass, other.mass_kg);
    }
    joint.anchor_m = body.position_m;
    if (chance(2)) joint.anchor_m += 0.5 * body.shape.size_m.minCoeff() * direction();
    joint.length_m = (joint.anchor_m - joint.other_anchor_m).norm() * between(0.0, 2.0);
    const double rate_1_s = powers(0.01, 30.0) / scene_.time_step_s;
    joint.stiffness_newton_m = std::clamp(mass * rate_1_s * rate_1_s, 1e-12, kMost);
    if (chance(2)) joint.damping_newton_s_m = std::min(mass * rate_1_s * powers(0.01, 10.0), kMost);
    joint.can_collide = chance(2);
    return joint;
  }

  FuzzJoint joint(const FuzzBody& body) {
    constexpr const char* kTypes[] = {"ball", "hinge", "slider", "fixed", "distance"};
    FuzzJoint joint;
    joint.type = kTypes[below(5)];
    joint.body = body.id;
    Vec3 other = body.position_m + size_m_ * direction();
    if (body.id > 0 && !chance(3)) {
      joint.other_body = below(body.id);
      other = scene_.bodies[*joint.other_body].position_m;
    }
    joint.anchor_m =
        joint.type == "distance" ? body.position_m : Vec3(0.5 * (body.position_m + other));
    joint.other_anchor_m = other;
    joint.axis = direction();
    joint.can_collide = chance(4);
    if (joint.type == "hinge" || joint.type == "slider") bound(body, joint);
    return joint;
  }

  // Motors go at most a tenth of the smaller body in a step and take up to 100 steps to get there:
  // contacts ahead know no motor.
  void bound(const FuzzBody& body, FuzzJoint& joint) {
    const bool turns = joint.type == "hinge";
    const double way = turns ? 1.5 : size_m_;
    if ((!turns && joint.other_body) || chance(2))
      joint.limits = {-way * between(0.0, 2.0), way * between(0.0, 2.0)};
    if (!chance(3)) return;
    double mass = body.mass_kg, size = body.shape.size_m.minCoeff();
    if (joint.other_body) {
      const FuzzBody& other = scene_.bodies[*joint.other_body];
      mass = std::min(mass, other.mass_kg);
      size = std::min(size, other.shape.size_m.minCoeff());
    }
    const double arm = turns ? size_m_ : 1.0;
    const double speed = std::min(size / arm / scene_.time_step_s, 1e6) * powers(1e-3, 0.1);
    constexpr double kMostPush = 1e15;  // that a scenario may say
    const double push =
        std::min(mass * arm * arm * speed / scene_.time_step_s * powers(0.01, 10.0), kMostPush);
    joint.motor = {chance(2) ? speed : -speed, push};
  }

  scenarios::RandomStream random_;
  FuzzScene scene_;
  double size_m_ = 1.0, mass_kg_ = 1.0;
  bool wild_sizes_ = false, wild_masses_ = false, crowded_ = false;
};

}  // namespace

FuzzScene draw_scene(std::uint64_t seed, std::int64_t steps, FuzzJoints joints) {
  return Draw(seed, steps).scene(joints);
}

}  // namespace soda::analysis
