#include "analysis/families/family_run.hpp"
#include "analysis/text/json_text.hpp"

namespace soda::analysis {
namespace {

std::string text_or_null(const std::string& text) { return text.empty() ? "null" : quoted(text); }

std::string measure_json(const FamilyMeasure& measure) {
  JsonObject json;
  return json.set("name", quoted(measure.name))
      .set("meaning", quoted(measure.meaning))
      .set("bound", json_of(measure.bound))
      .set("floor", json_of(measure.floor))
      .set("floor_reason", quoted(measure.floor_reason))
      .text();
}

std::string run_json(const FamilyRun& run, bool is_timed) {
  JsonObject json;
  return json.set("n", json_of(run.n))
      .set("bodies", json_of(run.bodies))
      .set("steps", json_of(run.steps))
      .set("errors", list_of(run.fault.empty() ? run.errors : std::vector<double>{},
                             [](double error) { return finite_or_null(error); }))
      .set("fault", text_or_null(run.fault))
      .set("cpu_us", is_timed ? json_of(run.cpu_us) : "null")
      .set("work", json_of(run.work))
      .set("impacts", json_of(run.impacts))
      .set("row_sweeps", json_of(run.row_sweeps))
      .set("multiplications", json_of(run.multiplications))
      .text();
}

std::string miss_json(const FamilyMiss& miss) {
  JsonObject json;
  return json.set("kind", quoted(name_of(miss.kind)))
      .set("measure", text_or_null(miss.measure))
      .set("from_n", miss.from_n > 0 ? json_of(miss.from_n) : "null")
      .set("n", json_of(miss.n))
      .set("from", finite_or_null(miss.from))
      .set("to", finite_or_null(miss.to))
      .set("what", text_or_null(miss.what))
      .text();
}

std::string series_json(const FamilySeriesReport& series, bool is_timed) {
  JsonObject json;
  return json.set("series", quoted(series.name))
      .set("runs",
           list_of(series.runs, [&](const FamilyRun& run) { return run_json(run, is_timed); }))
      .set("misses", list_of(series.misses, miss_json))
      .set("left_out", text_or_null(series.left_out))
      .text();
}

}  // namespace

std::string families_json(const FamiliesReport& report) {
  const std::string families = list_of(report.families, [&](const FamilyReport& family) {
    JsonObject json;
    return json.set("family", quoted(family.name))
        .set("scene", quoted(family.scene))
        .set("measures", list_of(family.measures, measure_json))
        .set("series", list_of(family.series,
                               [&](const FamilySeriesReport& series) {
                                 return series_json(series, report.is_timed);
                               }))
        .text();
  });
  JsonObject json;
  return json.set("missed", json_of(report.misses()))
             .set("jump", json_of(kFamilyJump))
             .set("least_work", json_of(kLeastFamilyWork))
             .set("families", families)
             .text() +
         "\n";
}

}  // namespace soda::analysis
