// MuJoCo, as a module: Newton solver, elliptic cones, default impedances. It has no restitution; a
// pair that bounces gets the underdamped contact spring that loses as much speed in one impact.
#include <mujoco/mujoco.h>

#include <array>
#include <cstring>
#include <numbers>
#include <sstream>

#include "analysis/accuracy/engine.hpp"
#include "analysis/accuracy/peer_scene.hpp"
#include "physics/math/rigid_motion.hpp"

namespace soda::analysis {
namespace {

using physics::BodyState;
using physics::Quat;
using physics::Vec3;

std::string numbers(std::initializer_list<double> values) {
  std::ostringstream text;
  text.precision(17);
  for (const double value : values) text << value << ' ';
  return text.str();
}
std::string numbers(const Vec3& v) { return numbers({v.x(), v.y(), v.z()}); }
std::string numbers(const Quat& q) { return numbers({q.w(), q.x(), q.y(), q.z()}); }

std::string shape_attributes(const physics::Shape& shape) {
  if (const auto* s = std::get_if<physics::Sphere>(&shape))
    return "type=\"sphere\" size=\"" + numbers({s->radius_m}) + "\"";
  if (const auto* s = std::get_if<physics::Box>(&shape))
    return "type=\"box\" size=\"" + numbers(s->half_extents_m) + "\"";
  if (const auto* s = std::get_if<physics::Capsule>(&shape))
    return "type=\"capsule\" size=\"" + numbers({s->radius_m, 0.5 * s->length_m}) + "\"";
  const auto& s = std::get<physics::Cylinder>(shape);
  return "type=\"cylinder\" size=\"" + numbers({s.radius_m, 0.5 * s.length_m}) + "\"";
}

// Friction and, where something bounces, the spring. The natural frequency is that of the default
// time constant of 0.02 s; the damping ratio is the one whose half swing leaves e of the speed.
std::string surface_attributes(double friction, double restitution) {
  std::string text = friction > 0.0 ? " condim=\"3\" friction=\"" + numbers({friction, 0, 0}) + "\""
                                    : " condim=\"1\"";
  if (restitution > 0.0) {
    const double frequency = 1.0 / 0.02, loss = -std::log(restitution);
    const double ratio = loss / std::hypot(std::numbers::pi, loss);
    text += " solref=\"" + numbers({-frequency * frequency, -2.0 * ratio * frequency}) + "\"";
  }
  return text;
}

std::string static_geom(const physics::SceneDescription& scene, const physics::StaticBody& fixed) {
  const physics::Material& other = scene.bodies.front().material;
  // Its priority makes these values those of the pair.
  const std::string surface =
      " priority=\"1\"" +
      surface_attributes(pair_friction(fixed.material.friction, other.friction),
                         pair_restitution(fixed.material.restitution, other.restitution));
  const physics::Shape& shape = scene.shapes[fixed.shape];
  if (const auto* plane = std::get_if<physics::HalfSpace>(&shape)) {
    const Vec3 normal = (fixed.orientation * plane->normal).normalized();
    const Vec3 at = fixed.position_m + normal * plane->offset_m;
    const Quat turned = physics::turn_between(Vec3::UnitZ(), normal);
    return "<geom type=\"plane\" size=\"0 0 1\" pos=\"" + numbers(at) + "\" quat=\"" +
           numbers(turned) + "\"" + surface + "/>\n";
  }
  return "<geom " + shape_attributes(shape) + " pos=\"" + numbers(fixed.position_m) + "\" quat=\"" +
         numbers(fixed.orientation) + "\"" + surface + "/>\n";
}

std::string model_text(const physics::SceneDescription& scene, std::span<const BodyState> initial,
                       const EngineSetting& setting) {
  // Room for contacts and their rows; memory grows with rows times bodies.
  const std::size_t contacts = 100 + 16 * initial.size();
  bool rubs = false;
  for (const physics::BodyParams& body : scene.bodies) rubs = rubs || body.material.friction > 0.0;
  std::string text =
      "<mujoco><compiler boundmass=\"0\" boundinertia=\"0\" balanceinertia=\"false\"/>"
      "<option cone=\"elliptic\" timestep=\"" +
      numbers({setting.dt_s}) + "\" gravity=\"" + numbers(scene.gravity_m_s2) + "\"";
  if (setting.iterations > 0) text += " iterations=\"" + std::to_string(setting.iterations) + "\"";
  text += "/><size nconmax=\"" + std::to_string(contacts) + "\" njmax=\"" +
          std::to_string((rubs ? 3 : 1) * contacts) + "\"/><worldbody>\n";
  for (const physics::StaticBody& fixed : scene.statics) text += static_geom(scene, fixed);
  for (std::size_t i = 0; i < initial.size(); ++i) {
    const physics::BodyParams& body = scene.bodies[i];
    text += "<body pos=\"" + numbers(initial[i].position_m) + "\" quat=\"" +
            numbers(initial[i].orientation) + "\"><freejoint/><inertial pos=\"0 0 0\" mass=\"" +
            numbers({body.mass_kg}) + "\" diaginertia=\"" +
            numbers(Vec3(body.inertia_local_kg_m2.diagonal())) + "\"/><geom " +
            shape_attributes(scene.shapes[body.shape]) +
            surface_attributes(body.material.friction, body.material.restitution) + "/></body>\n";
  }
  return text + "</worldbody></mujoco>\n";
}

mjModel* compiled(const std::string& text, std::string& why) {
  const auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  const int file = mj_makeEmptyFileVFS(files.get(), "scene.xml", static_cast<int>(text.size()));
  std::memcpy(files->filedata[files->nfile - 1], text.data(), text.size());
  std::array<char, 1000> error{};
  mjModel* model =
      file == 0 ? mj_loadXML("scene.xml", files.get(), error.data(), error.size()) : nullptr;
  if (model == nullptr) why = std::string("the model is refused: ") + error.data();
  mj_deleteVFS(files.get());
  return model;
}

class MujocoEngine final : public Engine {
 public:
  MujocoEngine(const physics::SceneDescription& scene, std::span<const BodyState> initial,
               const EngineSetting& setting)
      : count_(initial.size()), model_(compiled(model_text(scene, initial, setting), refused_)) {
    if (model_ == nullptr) return;
    data_ = mj_makeData(model_);
    for (std::size_t i = 0; i < count_; ++i) {
      // Spin is given in the frame of the body.
      const Vec3 local = initial[i].orientation.conjugate() * initial[i].angular_velocity_rad_s;
      for (int k = 0; k < 3; ++k) {
        data_->qvel[6 * i + static_cast<std::size_t>(k)] = initial[i].linear_velocity_m_s[k];
        data_->qvel[6 * i + 3 + static_cast<std::size_t>(k)] = local[k];
      }
    }
  }
  ~MujocoEngine() override {
    if (data_ != nullptr) mj_deleteData(data_);
    if (model_ != nullptr) mj_deleteModel(model_);
  }
  MujocoEngine(const MujocoEngine&) = delete;
  MujocoEngine& operator=(const MujocoEngine&) = delete;

  void step() override {
    if (data_ != nullptr) mj_step(model_, data_);
  }
  void read(std::vector<BodyState>& out) const override {
    out.resize(count_);
    for (std::size_t i = 0; i < count_; ++i) {
      const mjtNum *p = data_->qpos + 7 * i, *v = data_->qvel + 6 * i;
      out[i].position_m = Vec3(p[0], p[1], p[2]);
      out[i].orientation = Quat(p[3], p[4], p[5], p[6]).normalized();
      out[i].linear_velocity_m_s = Vec3(v[0], v[1], v[2]);
      out[i].angular_velocity_rad_s = out[i].orientation * Vec3(v[3], v[4], v[5]);
    }
  }
  void reverse() override {
    for (std::size_t i = 0; i < 6 * count_; ++i) data_->qvel[i] = -data_->qvel[i];
  }
  // It starts anew by itself when a state is no number.
  std::string fault() const override {
    if (data_ == nullptr) return refused_;
    for (const int warning :
         {mjWARN_BADQPOS, mjWARN_BADQVEL, mjWARN_BADQACC, mjWARN_CONTACTFULL, mjWARN_CNSTRFULL})
      if (data_->warning[warning].number > 0)
        return mju_warningText(warning, static_cast<size_t>(data_->warning[warning].lastinfo));
    return {};
  }

 private:
  const std::size_t count_;
  std::string refused_;
  mjModel* model_ = nullptr;
  mjData* data_ = nullptr;
};

std::string unknown_to_mujoco(const physics::SceneDescription& scene) {
  if (scene.bodies.empty()) return "no bodies";
  if (scene.bodies.size() > 300) return "its dense matrices are for up to 300 free bodies here";
  for (const physics::BodyParams& body : scene.bodies)
    if (body.material.friction != scene.bodies.front().material.friction ||
        body.material.restitution != scene.bodies.front().material.restitution)
      return "bodies of several materials are not handed over";
  return unknown_to_peers(scene, false);
}

}  // namespace
}  // namespace soda::analysis

extern "C" void soda_append_engines(std::vector<soda::analysis::EngineKind>& kinds) {
  using namespace soda::analysis;
  kinds.push_back({"mujoco", mj_versionString(), unknown_to_mujoco,
                   [](const soda::physics::SceneDescription& scene,
                      std::span<const soda::physics::BodyState> initial,
                      const EngineSetting& setting) -> std::unique_ptr<Engine> {
                     return std::make_unique<MujocoEngine>(scene, initial, setting);
                   }});
}
