#include "analysis/accuracy_report.hpp"
#include "analysis/json_output.hpp"
#include "analysis/json_text.hpp"

namespace soda::analysis {
namespace {

Json contacts_json(const physics::ContactQuality& contacts) {
  using Residuals = physics::ContactResiduals;
  if (contacts.points == 0) return nullptr;
  const auto law = [&contacts](double Residuals::*member) -> Json {
    return {{"largest", contacts.largest.*member}, {"mean", contacts.mean(member)}};
  };
  return {{"points", contacts.points},
          {"signorini_m_s", law(&Residuals::signorini_m_s)},
          {"complementarity_m_s", law(&Residuals::complementarity_m_s)},
          {"cone_m_s", law(&Residuals::cone_m_s)},
          {"dissipation_m_s", law(&Residuals::dissipation_m_s)}};
}

Json estimates_json(const std::optional<ErrorEstimates>& estimates) {
  if (!estimates) return nullptr;
  return {{"largest", estimates->largest},
          {"sum", estimates->sum},
          {"islands", estimates->islands},
          {"beyond_tolerance", estimates->beyond}};
}

}  // namespace

std::string accuracy_json(const AccuracyReport& report) {
  const auto bound = [](const std::optional<double>& b) { return b ? Json(*b) : Json(); };
  Json cases = Json::array();
  for (const AccuracyReport::Case& one : report.cases) {
    Json runs = Json::array();
    for (const CaseRun& run : one.runs) {
      Json errors = Json::array();
      for (const JudgedMeasure& m : run.measures)
        errors.push_back({{"reference", m.form},
                          {"measure", m.measure},
                          {"value", m.value},
                          {"must", bound(m.must)},
                          {"stretch", bound(m.stretch)},
                          {"missed", m.missed()}});
      runs.push_back(
          {{"engine", run.engine},
           {"dt_s", run.setting.dt_s},
           {"iterations", run.setting.iterations},
           {"tolerance", run.setting.tolerance > 0.0 ? Json(run.setting.tolerance) : Json()},
           {"steps", run.steps},
           {"cpu_s_per_simulated_s", run.cpu_per_simulated_s},
           {"step_ms", run.step_ms},
           {"errors", std::move(errors)},
           {"contacts", contacts_json(run.contacts)},
           {"estimates", estimates_json(run.estimates)},
           {"fault", run.fault.empty() ? Json() : Json(run.fault)}});
    }
    cases.push_back({{"case", one.name}, {"runs", std::move(runs)}, {"left_out", one.left_out}});
  }
  Json advantages = Json::array();
  for (const Advantage& a : advantages_of_others(report))
    advantages.push_back({{"case", a.scene},
                          {"measure", a.measure},
                          {"engine", a.engine},
                          {"dt_s", a.dt_s},
                          {"error", a.error},
                          {"cpu_s_per_simulated_s", a.cpu_per_simulated_s},
                          {"soda_cpu_s_per_simulated_s", bound(a.soda_cpu_per_simulated_s)}});
  return dumped({{"cases", std::move(cases)},
                 {"advantages_of_others", std::move(advantages)},
                 {"missed", report.missed()},
                 {"missing_engines", report.missing_engines}});
}

std::string extremes_json(const ExtremesReport& report) {
  Json runs = Json::array();
  for (const ExtremeRun& run : report.runs)
    runs.push_back({{"size_m", run.setting.size_m},
                    {"dt_s", run.setting.dt_s},
                    {"offset_m", run.setting.offset_m},
                    {"mass_kg", run.setting.mass_kg},
                    {"steps", run.steps},
                    {"displacement_rel", run.displacement_rel},
                    {"fault", run.fault.empty() ? Json() : Json(run.fault)}});
  return dumped({{"must", kExtremesMust},
                 {"stretch", kExtremesStretch},
                 {"missed", report.beyond(kExtremesMust)},
                 {"runs", runs}});
}

}  // namespace soda::analysis
