#include <dlfcn.h>

#include "analysis/accuracy/engine.hpp"
#include "analysis/process/installed.hpp"

namespace soda::analysis {

std::vector<PeerModule> peer_modules() {
  return {{"bullet", "libbullet-dev"}, {"ode", "libode-dev"}, {"mujoco", "libmujoco-dev"}};
}

// Modules stay loaded until the program ends, because their engines do.
std::vector<EngineKind> engine_kinds() {
  std::vector<EngineKind> kinds = soda_engines();
  for (const PeerModule& peer : peer_modules()) {
    const std::string module = module_file("soda_engine_" + peer.name + ".so");
    void* const library = dlopen(module.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (library == nullptr) continue;
    const auto append = reinterpret_cast<AppendEngines>(dlsym(library, kPeerEnginesSymbol));
    if (append != nullptr) append(kinds);
  }
  return kinds;
}

}  // namespace soda::analysis
