#include "analysis/calibration/machine_costs.hpp"

#include <algorithm>

#include "analysis/text/json_text.hpp"
#include "scenarios/field_binding.hpp"
#include "scenarios/read_json.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::analysis {
namespace {

using scenarios::field;
using scenarios::Field;
using scenarios::Limits;

constexpr std::int64_t kCostsFormat = 1;
constexpr Limits kFactors{kLeastFactor, 1000.0};

struct FactorsSpec : scenarios::Located {
  double events = 1.0;
  double bodies = 1.0;
  double tests = 1.0;
  double points = 1.0;
  double sweeps = 1.0;
  double factors = 1.0;
  double joints = 1.0;
  double impacts = 1.0;
  double division = 1.0;
  double checkpoints = 1.0;
};

struct CostsSpec : scenarios::Located {
  std::int64_t format = kCostsFormat;
  std::string machine;
  FactorsSpec factors;
  double gvt_ns = 0.0;
  std::int64_t processors = 1;
  double slow_down = 1.0;
};

constexpr Field kFactorFields[] = {
    field<FactorsSpec, &FactorsSpec::events>("events", true, kFactors, "Of the usual costs."),
    field<FactorsSpec, &FactorsSpec::bodies>("bodies", true, kFactors, "Of the usual costs."),
    field<FactorsSpec, &FactorsSpec::tests>("tests", true, kFactors, "Of the usual costs."),
    field<FactorsSpec, &FactorsSpec::points>("points", true, kFactors, "Of the usual costs."),
    field<FactorsSpec, &FactorsSpec::sweeps>("sweeps", true, kFactors, "Of the usual costs."),
    field<FactorsSpec, &FactorsSpec::factors>("factors", true, kFactors, "Of the usual costs."),
    field<FactorsSpec, &FactorsSpec::joints>("joints", true, kFactors, "Of the usual costs."),
    field<FactorsSpec, &FactorsSpec::impacts>("impacts", true, kFactors, "Of the usual costs."),
    field<FactorsSpec, &FactorsSpec::division>("division", true, kFactors, "Of the usual costs."),
    field<FactorsSpec, &FactorsSpec::checkpoints>("checkpoints", true, kFactors,
                                                  "Of the usual costs."),
};
constexpr scenarios::ObjectTable kFactorTable =
    scenarios::object_table<FactorsSpec>("factors", "Factors of the usual costs.", kFactorFields);

constexpr Field kCostsFields[] = {
    field<CostsSpec, &CostsSpec::format>("format", true, Limits{1.0, 1.0}, "1."),
    field<CostsSpec, &CostsSpec::machine>("machine", true, Limits{0.0, 0.0, 1, 200},
                                          "The processor's name."),
    scenarios::object_field<CostsSpec, &CostsSpec::factors>("factors", true, Limits{}, kFactorTable,
                                                            "By group."),
    field<CostsSpec, &CostsSpec::gvt_ns>("gvt_ns", true, Limits{0.0, 1e9},
                                         "A worker's part of a round."),
    field<CostsSpec, &CostsSpec::processors>("processors", true, Limits{1.0, 1e6},
                                             "That work at the same time."),
    field<CostsSpec, &CostsSpec::slow_down>("slow_down", true, Limits{1.0, 1000.0},
                                            "Of work while all of them work."),
};
constexpr scenarios::ObjectTable kCostsTable =
    scenarios::object_table<CostsSpec>("costs", "What work costs on a machine.", kCostsFields);

CostFactors factors_of(const FactorsSpec& spec) {
  return {spec.events,  spec.bodies, spec.tests,   spec.points,   spec.sweeps,
          spec.factors, spec.joints, spec.impacts, spec.division, spec.checkpoints};
}

}  // namespace

// Between one processor and all that were measured, as much slower as there are more.
models::CostWeights weights_for(const MachineCosts& costs, std::size_t processors) {
  double slower = 1.0;
  if (costs.processors > 1 && processors > 1) {
    const auto among = static_cast<double>(costs.processors - 1);
    const double share = std::min(1.0, static_cast<double>(processors - 1) / among);
    slower += share * (costs.slow_down - 1.0);
  }
  CostFactors factors = costs.factors;
  for (double& factor : factors) factor *= slower;
  models::CostWeights weights = models::scaled({}, factors);
  weights.gvt_ps = static_cast<std::int64_t>(1000.0 * costs.gvt_ns * slower);
  weights.commit_ps = 0;
  return weights;
}

std::string machine_costs_json(const MachineCosts& costs) {
  std::string text = "{\n  \"format\": " + json_of(kCostsFormat) +
                     ",\n  \"machine\": " + quoted(costs.machine) + ",\n  \"factors\": {";
  for (std::size_t group = 0; group < costs.factors.size(); ++group)
    text += std::string(group > 0 ? ",\n" : "\n") + "    " +
            quoted(name_of(static_cast<models::CostGroup>(group))) + ": " +
            json_of(costs.factors[group]);
  return text + "\n  },\n  \"gvt_ns\": " + json_of(costs.gvt_ns) +
         ",\n  \"processors\": " + json_of(costs.processors) +
         ",\n  \"slow_down\": " + json_of(costs.slow_down) + "\n}\n";
}

MachineCosts read_machine_costs(const std::string& file) {
  const std::string text = scenarios::read_text(file);
  scenarios::FaultList faults;
  const scenarios::JsonTree tree = scenarios::parse_json(text, faults);
  CostsSpec spec;
  if (tree.root() != nullptr) scenarios::read_object(kCostsTable, *tree.root(), &spec, faults);
  if (!faults.empty()) {
    scenarios::sort_by_place(faults);
    throw scenarios::InputError(file, std::move(faults));
  }
  return {spec.machine, factors_of(spec.factors), spec.gvt_ns, spec.processors, spec.slow_down};
}

}  // namespace soda::analysis
