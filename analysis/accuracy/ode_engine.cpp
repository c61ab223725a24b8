// ODE, as a module, twice: the iterative QuickStep and the direct step. Gyroscopic terms on,
// friction proportional to the normal force (a pyramid), damping and sleeping off.
#include <ode/ode.h>

#include "analysis/accuracy/engine.hpp"
#include "analysis/accuracy/peer_scene.hpp"

namespace soda::analysis {
namespace {

using physics::BodyState;
using physics::Quat;
using physics::Vec3;

class OdeEngine final : public Engine {
 public:
  OdeEngine(const physics::SceneDescription& scene, std::span<const BodyState> initial,
            const EngineSetting& setting, bool direct)
      : dt_s_(setting.dt_s),
        direct_(direct),
        bounce_speed_m_s_(scene.solver.restitution_threshold_m_s) {
    dInitODE2(0);
    dRandSetSeed(1);
    world_ = dWorldCreate();
    space_ = dHashSpaceCreate(nullptr);
    contacts_ = dJointGroupCreate(0);
    dWorldSetGravity(world_, scene.gravity_m_s2.x(), scene.gravity_m_s2.y(),
                     scene.gravity_m_s2.z());
    if (setting.iterations > 0) dWorldSetQuickStepNumIterations(world_, setting.iterations);
    materials_.reserve(scene.statics.size() + initial.size());
    for (const physics::StaticBody& fixed : scene.statics) add_static(scene, fixed);
    for (std::size_t i = 0; i < initial.size(); ++i) add_body(scene, scene.bodies[i], initial[i]);
    for (const physics::Joint& joint : scene.joints) add_ball(joint, initial);
  }
  ~OdeEngine() override {
    dJointGroupDestroy(contacts_);
    dSpaceDestroy(space_);
    dWorldDestroy(world_);
    dCloseODE();
  }

  void step() override {
    dSpaceCollide(space_, this, [](void* self, dGeomID a, dGeomID b) {
      static_cast<OdeEngine*>(self)->touch(a, b);
    });
    if (direct_)
      dWorldStep(world_, dt_s_);
    else
      dWorldQuickStep(world_, dt_s_);
    dJointGroupEmpty(contacts_);
  }
  void read(std::vector<BodyState>& out) const override {
    out.resize(bodies_.size());
    for (std::size_t i = 0; i < out.size(); ++i) {
      const dReal* p = dBodyGetPosition(bodies_[i]);
      const dReal* q = dBodyGetQuaternion(bodies_[i]);
      const dReal* v = dBodyGetLinearVel(bodies_[i]);
      const dReal* w = dBodyGetAngularVel(bodies_[i]);
      out[i].position_m = Vec3(p[0], p[1], p[2]);
      out[i].orientation = Quat(q[0], q[1], q[2], q[3]).normalized();
      out[i].linear_velocity_m_s = Vec3(v[0], v[1], v[2]);
      out[i].angular_velocity_rad_s = Vec3(w[0], w[1], w[2]);
    }
  }
  void reverse() override {
    for (const dBodyID body : bodies_) {
      const dReal* v = dBodyGetLinearVel(body);
      dBodySetLinearVel(body, -v[0], -v[1], -v[2]);
      const dReal* w = dBodyGetAngularVel(body);
      dBodySetAngularVel(body, -w[0], -w[1], -w[2]);
    }
  }

 private:
  void touch(dGeomID a, dGeomID b) {
    const dBodyID body_a = dGeomGetBody(a), body_b = dGeomGetBody(b);
    if (body_a == nullptr && body_b == nullptr) return;
    if (body_a != nullptr && body_b != nullptr &&
        dAreConnectedExcluding(body_a, body_b, dJointTypeContact))
      return;
    const auto& one = *static_cast<const physics::Material*>(dGeomGetData(a));
    const auto& two = *static_cast<const physics::Material*>(dGeomGetData(b));
    dContact points[8] = {};
    const int count = dCollide(a, b, 8, &points[0].geom, sizeof(dContact));
    for (int i = 0; i < count; ++i) {
      dSurfaceParameters& surface = points[i].surface;
      surface.mode = dContactApprox1;
      surface.mu = pair_friction(one.friction, two.friction);
      const double restitution = pair_restitution(one.restitution, two.restitution);
      if (restitution > 0.0) {
        surface.mode |= dContactBounce;
        surface.bounce = restitution;
        surface.bounce_vel = bounce_speed_m_s_;
      }
      dJointAttach(dJointCreateContact(world_, contacts_, &points[i]), dGeomGetBody(a),
                   dGeomGetBody(b));
    }
  }

  dGeomID geom_of(const physics::Shape& shape) {
    if (const auto* s = std::get_if<physics::Sphere>(&shape))
      return dCreateSphere(space_, s->radius_m);
    if (const auto* s = std::get_if<physics::Box>(&shape))
      return dCreateBox(space_, 2 * s->half_extents_m.x(), 2 * s->half_extents_m.y(),
                        2 * s->half_extents_m.z());
    if (const auto* s = std::get_if<physics::Capsule>(&shape))
      return dCreateCapsule(space_, s->radius_m, s->length_m);
    const auto& s = std::get<physics::Cylinder>(shape);
    return dCreateCylinder(space_, s.radius_m, s.length_m);
  }
  void name_material(dGeomID geom, const physics::Material& material) {
    materials_.push_back(material);
    dGeomSetData(geom, &materials_.back());
  }
  void add_static(const physics::SceneDescription& scene, const physics::StaticBody& fixed) {
    const physics::Shape& shape = scene.shapes[fixed.shape];
    const auto* plane = std::get_if<physics::HalfSpace>(&shape);
    if (plane != nullptr) {
      const Vec3 n = fixed.orientation * plane->normal;
      const double offset = plane->offset_m + n.dot(fixed.position_m);
      name_material(dCreatePlane(space_, n.x(), n.y(), n.z(), offset), fixed.material);
      return;
    }
    const dGeomID geom = geom_of(shape);
    const Vec3& p = fixed.position_m;
    const Quat& q = fixed.orientation;
    const dQuaternion turned = {q.w(), q.x(), q.y(), q.z()};
    dGeomSetPosition(geom, p.x(), p.y(), p.z());
    dGeomSetQuaternion(geom, turned);
    name_material(geom, fixed.material);
  }
  void add_body(const physics::SceneDescription& scene, const physics::BodyParams& params,
                const BodyState& state) {
    const dBodyID body = dBodyCreate(world_);
    const auto& inertia = params.inertia_local_kg_m2;
    dMass mass;
    dMassSetParameters(&mass, params.mass_kg, 0, 0, 0, inertia(0, 0), inertia(1, 1), inertia(2, 2),
                       inertia(0, 1), inertia(0, 2), inertia(1, 2));
    dBodySetMass(body, &mass);
    const Vec3 &p = state.position_m, &v = state.linear_velocity_m_s,
               &w = state.angular_velocity_rad_s;
    const Quat& q = state.orientation;
    const dQuaternion turned = {q.w(), q.x(), q.y(), q.z()};
    dBodySetPosition(body, p.x(), p.y(), p.z());
    dBodySetQuaternion(body, turned);
    dBodySetLinearVel(body, v.x(), v.y(), v.z());
    dBodySetAngularVel(body, w.x(), w.y(), w.z());
    const dGeomID geom = geom_of(scene.shapes[params.shape]);
    dGeomSetBody(geom, body);
    name_material(geom, params.material);
    bodies_.push_back(body);
  }

  // Destroyed with the world.
  void add_ball(const physics::Joint& joint, std::span<const BodyState> initial) {
    const dBodyID a = bodies_[physics::index_of(joint.a)];
    const bool world = joint.b == physics::kWorldBody;
    const dBodyID b = world ? nullptr : bodies_[physics::index_of(joint.b)];
    const BodyState& state = initial[physics::index_of(joint.a)];
    const Vec3 anchor = state.position_m + state.orientation * joint.anchor_a_m;
    const dJointID ball = dJointCreateBall(world_, nullptr);
    dJointAttach(ball, a, b);
    dJointSetBallAnchor(ball, anchor.x(), anchor.y(), anchor.z());
  }

  const double dt_s_;
  const bool direct_;
  const double bounce_speed_m_s_;
  dWorldID world_ = nullptr;
  dSpaceID space_ = nullptr;
  dJointGroupID contacts_ = nullptr;
  std::vector<dBodyID> bodies_;
  std::vector<physics::Material> materials_;  // geoms point into it: reserved once
};

// ODE knows no contact between two cylinders, nor a cylinder and a capsule.
std::string unknown_to_ode(const physics::SceneDescription& scene) {
  bool cylinders = false;
  for (const physics::Shape& shape : scene.shapes)
    cylinders = cylinders || std::holds_alternative<physics::Cylinder>(shape);
  if (cylinders && scene.bodies.size() > 1) return "cylinders do not meet each other there";
  return unknown_to_peers(scene, true);
}

template <bool kDirect>
std::unique_ptr<Engine> make_ode(const physics::SceneDescription& scene,
                                 std::span<const BodyState> initial, const EngineSetting& setting) {
  return std::make_unique<OdeEngine>(scene, initial, setting, kDirect);
}

// Its time grows with the cube of the contacts of an island.
std::string too_large_for_direct(const physics::SceneDescription& scene) {
  if (scene.bodies.size() > 60) return "the direct step is for up to 60 bodies here";
  return unknown_to_ode(scene);
}

}  // namespace
}  // namespace soda::analysis

extern "C" void soda_append_engines(std::vector<soda::analysis::EngineKind>& kinds) {
  using namespace soda::analysis;
  kinds.push_back({"ode", SODA_ODE_VERSION, unknown_to_ode, make_ode<false>});
  kinds.push_back({"ode-direct", SODA_ODE_VERSION, too_large_for_direct, make_ode<true>});
}
