#include "analysis/process/job.hpp"

#include <dlfcn.h>

#include <cstdlib>
#include <filesystem>

#include "analysis/process/installed.hpp"
#include "analysis/text/exit_codes.hpp"

namespace soda::analysis {
namespace {

// Open MPI, PMIx and PMI launchers.
bool started_by_mpirun() {
  for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_RANK"})
    if (std::getenv(name) != nullptr) return true;
  return false;
}

}  // namespace

std::unique_ptr<kernel::Transport> join_job() {
  if (!started_by_mpirun()) return nullptr;
  const std::string module = module_file("soda_mpi.so");
  if (!std::filesystem::exists(module))
    throw UsageError("started by mpirun, but this soda was built without MPI (no " + module + ")");
  // Global: MPI loads parts of its own that look for its symbols.
  void* const library = dlopen(module.c_str(), RTLD_NOW | RTLD_GLOBAL);
  if (library == nullptr) throw UsageError(std::string("MPI cannot be loaded: ") + dlerror());
  const auto start =
      reinterpret_cast<kernel::StartMpi>(dlsym(library, kernel::kMpiTransportSymbol));
  if (start == nullptr) throw UsageError(module + ": not a module of this soda");
  return std::unique_ptr<kernel::Transport>(start());
}

int end_job(kernel::Transport* transport, const Ending& ending, std::ostream& err) {
  if (transport == nullptr) {
    err << ending.message;
    return ending.code;
  }
  if (transport->runs()) {
    err << ending.message << std::flush;
    transport->abort(ending.code);
  }
  if (ending.of_another) return ending.code;
  const kernel::Transport::Agreement agreement = transport->agree(ending.code);
  // What was reported without failing, the root alone reports.
  const std::uint32_t speaker = agreement.code == 0 ? 0 : agreement.rank;
  if (transport->rank() == speaker) err << ending.message << std::flush;
  return agreement.code;
}

}  // namespace soda::analysis
