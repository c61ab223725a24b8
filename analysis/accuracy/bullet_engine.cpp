// Bullet, as a module: double precision, sequential impulses, gyroscopic terms on, damping and
// sleeping off. Continuous collision is on for bodies that start faster than their width a step.
#include <btBulletDynamicsCommon.h>

#include "analysis/accuracy/engine.hpp"
#include "analysis/accuracy/peer_scene.hpp"

namespace soda::analysis {
namespace {

using physics::BodyState;
using physics::Quat;
using physics::Vec3;

btVector3 to_bullet(const Vec3& v) { return {v.x(), v.y(), v.z()}; }
btQuaternion to_bullet(const Quat& q) { return {q.x(), q.y(), q.z(), q.w()}; }
Vec3 from_bullet(const btVector3& v) { return {v.x(), v.y(), v.z()}; }

btScalar combined_friction(const btCollisionObject* a, const btCollisionObject* b) {
  return pair_friction(a->getFriction(), b->getFriction());
}
btScalar combined_restitution(const btCollisionObject* a, const btCollisionObject* b) {
  return pair_restitution(a->getRestitution(), b->getRestitution());
}

std::unique_ptr<btCollisionShape> shape_of(const physics::Shape& shape) {
  if (const auto* s = std::get_if<physics::Sphere>(&shape))
    return std::make_unique<btSphereShape>(s->radius_m);
  if (const auto* s = std::get_if<physics::Box>(&shape))
    return std::make_unique<btBoxShape>(to_bullet(s->half_extents_m));
  if (const auto* s = std::get_if<physics::Capsule>(&shape))
    return std::make_unique<btCapsuleShapeZ>(s->radius_m, s->length_m);
  if (const auto* s = std::get_if<physics::Cylinder>(&shape))
    return std::make_unique<btCylinderShapeZ>(
        btVector3(s->radius_m, s->radius_m, 0.5 * s->length_m));
  const auto& plane = std::get<physics::HalfSpace>(shape);
  return std::make_unique<btStaticPlaneShape>(to_bullet(plane.normal), plane.offset_m);
}

class BulletEngine final : public Engine {
 public:
  BulletEngine(const physics::SceneDescription& scene, std::span<const BodyState> initial,
               const EngineSetting& setting)
      : dt_s_(setting.dt_s) {
    world_.setGravity(to_bullet(scene.gravity_m_s2));
    btContactSolverInfo& info = world_.getSolverInfo();
    info.m_restitutionVelocityThreshold = scene.solver.restitution_threshold_m_s;
    if (setting.iterations > 0) info.m_numIterations = setting.iterations;
    for (const physics::Shape& shape : scene.shapes) shapes_.push_back(shape_of(shape));
    for (const physics::StaticBody& fixed : scene.statics)
      add(0.0, btVector3(0, 0, 0), fixed.shape, fixed.material, fixed.position_m,
          fixed.orientation);
    moving_from_ = bodies_.size();
    for (std::size_t i = 0; i < initial.size(); ++i) {
      const physics::BodyParams& params = scene.bodies[i];
      btRigidBody& body =
          add(params.mass_kg, to_bullet(Vec3(params.inertia_local_kg_m2.diagonal())), params.shape,
              params.material, initial[i].position_m, initial[i].orientation);
      body.setLinearVelocity(to_bullet(initial[i].linear_velocity_m_s));
      body.setAngularVelocity(to_bullet(initial[i].angular_velocity_rad_s));
      const double width = half_width_m(scene.shapes[params.shape]);
      if (initial[i].linear_velocity_m_s.norm() * dt_s_ > width) {
        body.setCcdMotionThreshold(width);
        body.setCcdSweptSphereRadius(0.5 * width);
      }
    }
    for (const physics::Joint& joint : scene.joints) add_ball(joint);
  }
  ~BulletEngine() override {
    for (const auto& joint : joints_) world_.removeConstraint(joint.get());
    for (const auto& body : bodies_) world_.removeRigidBody(body.get());
  }

  void step() override { world_.stepSimulation(dt_s_, 0); }
  void read(std::vector<BodyState>& out) const override {
    out.resize(bodies_.size() - moving_from_);
    for (std::size_t i = 0; i < out.size(); ++i) {
      const btRigidBody& body = *bodies_[moving_from_ + i];
      const btQuaternion q = body.getOrientation();
      out[i].position_m = from_bullet(body.getCenterOfMassPosition());
      out[i].orientation = Quat(q.w(), q.x(), q.y(), q.z()).normalized();
      out[i].linear_velocity_m_s = from_bullet(body.getLinearVelocity());
      out[i].angular_velocity_rad_s = from_bullet(body.getAngularVelocity());
    }
  }
  void reverse() override {
    for (std::size_t i = moving_from_; i < bodies_.size(); ++i) {
      bodies_[i]->setLinearVelocity(-bodies_[i]->getLinearVelocity());
      bodies_[i]->setAngularVelocity(-bodies_[i]->getAngularVelocity());
    }
  }

 private:
  void add_ball(const physics::Joint& joint) {
    const auto body = [this](physics::BodyId id) -> btRigidBody& {
      return *bodies_[moving_from_ + physics::index_of(id)];
    };
    const btVector3 in_a = to_bullet(joint.anchor_a_m), in_b = to_bullet(joint.anchor_b_m);
    if (joint.b == physics::kWorldBody)
      joints_.push_back(std::make_unique<btPoint2PointConstraint>(body(joint.a), in_a));
    else
      joints_.push_back(
          std::make_unique<btPoint2PointConstraint>(body(joint.a), body(joint.b), in_a, in_b));
    world_.addConstraint(joints_.back().get(), true);
  }
  btRigidBody& add(double mass, const btVector3& inertia, std::uint32_t shape,
                   const physics::Material& material, const Vec3& position,
                   const Quat& orientation) {
    btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, shapes_[shape].get(), inertia);
    info.m_startWorldTransform = btTransform(to_bullet(orientation), to_bullet(position));
    info.m_friction = material.friction;
    info.m_restitution = material.restitution;
    bodies_.push_back(std::make_unique<btRigidBody>(info));
    bodies_.back()->setActivationState(DISABLE_DEACTIVATION);
    world_.addRigidBody(bodies_.back().get());
    return *bodies_.back();
  }

  const double dt_s_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_{&dispatcher_, &broadphase_, &solver_, &configuration_};
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;  // statics first
  std::size_t moving_from_ = 0;
  std::vector<std::unique_ptr<btTypedConstraint>> joints_;
};

}  // namespace
}  // namespace soda::analysis

extern "C" void soda_append_engines(std::vector<soda::analysis::EngineKind>& kinds) {
  using namespace soda::analysis;
  // The library knows these two as variables of its own.
  gCalculateCombinedFrictionCallback = combined_friction;
  gCalculateCombinedRestitutionCallback = combined_restitution;
  const int version = btGetVersion();
  kinds.push_back(
      {"bullet", std::to_string(version / 100) + "." + std::to_string(version % 100),
       [](const soda::physics::SceneDescription& scene) { return unknown_to_peers(scene, true); },
       [](const soda::physics::SceneDescription& scene,
          std::span<const soda::physics::BodyState> initial,
          const EngineSetting& setting) -> std::unique_ptr<Engine> {
         return std::make_unique<BulletEngine>(scene, initial, setting);
       }});
}
