// One way to run a scene: our own step, or another engine's, behind one seam.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "analysis/measures/error_estimates.hpp"
#include "physics/model/body_state.hpp"
#include "physics/model/scene.hpp"

namespace soda::analysis {

// How a scene is run: every engine knows these.
struct EngineSetting {
  double dt_s = 1.0 / 60.0;
  int iterations = 0;  // of the contact solver; 0: the scene's with soda, else the engine's default
  double tolerance = 0.0;  // of soda's accuracy mode; 0: the scene's
};

class Engine {
 public:
  virtual ~Engine() = default;
  // Advances the scene by dt_s. Nothing else of the engine costs time that is measured.
  virtual void step() = 0;
  // States of all bodies, by BodyId. Impulses are there with soda only.
  virtual void read(std::vector<physics::BodyState>& out) const = 0;
  // All velocities change their sign.
  virtual void reverse() = 0;
  // Why what it computed cannot be used (a state that is no number); empty if it can.
  virtual std::string fault() const { return {}; }
  // Of all steps so far; what the engine says of its errors, if it does.
  virtual std::optional<ErrorEstimates> estimates() const { return std::nullopt; }
};

struct EngineKind {
  std::string name;     // on the command line
  std::string version;  // as the library says, or the package
  // Why it cannot run this scene; empty if it can.
  std::string (*cannot)(const physics::SceneDescription& scene) = nullptr;
  std::unique_ptr<Engine> (*make)(const physics::SceneDescription& scene,
                                  std::span<const physics::BodyState> initial,
                                  const EngineSetting& setting) = nullptr;
};

// Every engine that can run, soda first. The others are modules beside the program, built where
// their Debian packages are installed and loaded here.
std::vector<EngineKind> engine_kinds();

// The modules that there can be: what their engines' names start with, and the Debian package that
// each is built from.
struct PeerModule {
  std::string name, package;
};
std::vector<PeerModule> peer_modules();

// What a module exports under kPeerEnginesSymbol: appends its engines.
using AppendEngines = void (*)(std::vector<EngineKind>&);
inline constexpr const char* kPeerEnginesSymbol = "soda_append_engines";

// At the settings of the scene.
EngineKind soda_engine();
// That, and at others instead: soda-fast and soda-accurate (scenarios/quality.hpp), soda-fcl and
// soda-own (physics::Narrowphase).
std::vector<EngineKind> soda_engines();
inline bool is_soda(const std::string& engine) { return engine.starts_with("soda"); }

}  // namespace soda::analysis
