#include "analysis/scaling/networks.hpp"

#include <algorithm>
#include <array>

#include "analysis/text/exit_codes.hpp"
#include "analysis/text/nearest_name.hpp"

namespace soda::analysis {
namespace {

constexpr std::array kNetworks = {
    NetworkPreset{"shared", 0.4, 1850.0,
                  "measured: 64 and 65,536 bytes between two ranks of Open MPI 4.1 on an AMD EPYC"},
    NetworkPreset{"infiniband", 1.5, 1500.0,
                  "Koop, Jones, Panda: MVAPICH-Aptus, IPDPS 2008 (DDR InfiniBand)"},
    NetworkPreset{"ten-gbe", 20.0, 1250.0,
                  "Hurwitz, Feng: Initial End-to-End Performance Evaluation of 10-Gigabit "
                  "Ethernet, Hot Interconnects 11, 2003; the line's rate"},
    NetworkPreset{"internet", 22'500.0, 12.5,
                  "Verizon's service level for the United States, 45 ms there and back; an access "
                  "of 100 Mbit/s"},
};

}  // namespace

std::span<const NetworkPreset> network_presets() { return kNetworks; }

const NetworkPreset& network_named(const std::string& name) {
  const auto found = std::ranges::find_if(
      kNetworks, [&name](const NetworkPreset& network) { return name == network.name; });
  if (found != kNetworks.end()) return *found;
  std::string allowed;
  std::vector<std::string> names;
  for (const NetworkPreset& network : kNetworks) {
    allowed += (allowed.empty() ? "" : ", ") + std::string(network.name);
    names.emplace_back(network.name);
  }
  const std::string nearest = nearest_name(name, names);
  throw UsageError("--network: found " + name + "; allowed: " + allowed +
                   (nearest.empty() ? "" : " (did you mean " + nearest + "?)"));
}

void apply_network(const NetworkPreset& network, ClusterOverrides& cluster) {
  if (!cluster.latency_us) cluster.latency_us = network.latency_us;
  if (!cluster.bandwidth_mb_s) cluster.bandwidth_mb_s = network.bandwidth_mb_s;
}

}  // namespace soda::analysis
