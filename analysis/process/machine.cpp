#include "analysis/process/machine.hpp"

#include <fstream>

namespace soda::analysis {

std::string machine_name() {
  std::ifstream cpus("/proc/cpuinfo");
  for (std::string line; std::getline(cpus, line);) {
    const std::size_t colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "unknown machine";
}

}  // namespace soda::analysis
