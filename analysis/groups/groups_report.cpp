#include "analysis/groups/groups_report.hpp"

#include <algorithm>
#include <cmath>

#include "analysis/groups/paper_scene.hpp"
#include "analysis/text/json_text.hpp"
#include "analysis/text/text_table.hpp"

namespace soda::analysis {
namespace {

constexpr std::size_t kRowsOfRun = 12;
constexpr std::uint32_t kLeastLattice = 100;  // fewer worlds have no threshold worth the name

std::string tenths(double value) { return format_exact(std::round(10.0 * value) / 10.0); }

std::string per_cent(const MeanOfSeeds& mean) {
  const std::string text = tenths(100.0 * mean.mean);
  return std::isnan(mean.half_width) ? text : text + " +- " + tenths(100.0 * mean.half_width);
}

std::string known_text(const FigureRow* row) {
  if (row == nullptr) return "-";
  std::string text;
  for (const int share : row->per_cent) text += (text.empty() ? "" : "/") + std::to_string(share);
  return text;
}

std::string title_of(const SweepReport& report) {
  return (report.name.empty() ? "" : report.name + ": ") + "the paper's scene, seeds " +
         std::to_string(report.seeds.first) + ".." + std::to_string(report.seeds.last);
}

std::vector<Column> class_columns(std::vector<Column> columns) {
  for (const char* name : kGroupClassNames) columns.push_back({name, Align::kRight});
  return columns;
}

std::string checked_text(const SweepReport& report) {
  std::size_t known = 0, off = 0, surely_off = 0;
  for (const SweepResult& result : report.results) {
    if (result.point.known == nullptr) continue;
    ++known;
    off += is_off(result);
    surely_off += result.points_beyond_chance > kFigurePoints;
  }
  if (known == 0) return "";
  return std::to_string(known - off) + " of " + std::to_string(known) + " rows are within " +
         format_number(kFigurePoints) + " points of the figures known beforehand; in " +
         std::to_string(surely_off) + " the confidence leaves no such figure\n";
}

std::string thresholds_text(const SweepReport& report) {
  std::string text;
  for (const std::vector<SweepResult>& series : series_of(report.results)) {
    const SweepPoint& point = series.front().point;
    if (series.size() < 3 || series[1].point.bodies == point.bodies) continue;
    if (point.worlds < kLeastLattice) continue;
    text += std::string("threshold by ") + name_of(point.bond) + ", map " + name_of(point.map) +
            ", " + std::to_string(point.worlds) + " worlds: ";
    const std::int64_t found = measured_threshold(series);
    const bool inside = found != series.front().point.bodies && found != series.back().point.bodies;
    text += inside ? "near " + std::to_string(found) + " bodies" : "not between these";
    if (point.bond == GroupBond::kOverlap) {
      const double law = Percolation(point.worlds, point.map).threshold_bodies();
      text += "; the law says " + format_number(std::round(law), 7);
    }
    text += "\n";
  }
  return text;
}

JsonObject shares_object(const GroupShares& shares) {
  JsonObject json;
  for (std::size_t k = 0; k < kGroupClasses; ++k) json.set(kGroupClassNames[k], json_of(shares[k]));
  return json;
}

JsonObject mean_object(const MeanOfSeeds& mean) {
  return JsonObject()
      .set("mean", json_of(mean.mean))
      .set("half_width", finite_or_null(mean.half_width));
}

std::string result_json(const SweepResult& result) {
  const SweepPoint& point = result.point;
  JsonObject shares, known;
  for (std::size_t k = 0; k < kGroupClasses; ++k) {
    shares.set(kGroupClassNames[k], mean_object(result.shares[k]).text());
    if (point.known != nullptr)
      known.set(kGroupClassNames[k], json_of(0.01 * point.known->per_cent[k]));
  }
  const Percolation law(point.worlds, point.map);
  const auto bodies = static_cast<double>(point.bodies);
  const bool has_law = point.bond == GroupBond::kOverlap;
  return JsonObject()
      .set("by", quoted(name_of(point.bond)))
      .set("map", quoted(name_of(point.map)))
      .set("bodies", json_of(point.bodies))
      .set("worlds", json_of(point.worlds))
      .set("shares", shares.text())
      .set("largest", mean_object(result.largest).text())
      .set("others", mean_object(result.others).text())
      .set("known", point.known == nullptr ? "null" : known.text())
      .set("points_off", finite_or_null(result.most_points_off))
      .set("points_beyond_chance", finite_or_null(result.points_beyond_chance))
      .set("law_bond_probability", has_law ? json_of(law.bond_probability(bodies)) : "null")
      .set("law_alone", has_law ? json_of(law.alone(bodies)) : "null")
      .set("law_threshold_bodies", has_law ? json_of(law.threshold_bodies()) : "null")
      .text();
}

std::string run_row_label(const BondOverTime& bond, std::size_t first, std::size_t end) {
  const std::string from = std::to_string(bond.steps[first].step);
  return end - first == 1 ? from : from + ".." + std::to_string(bond.steps[end - 1].step);
}

std::vector<std::string> row_of_steps(const BondOverTime& bond, std::size_t first,
                                      std::size_t end) {
  const StepGroups mean = mean_of_steps(bond, first, end);
  std::vector<std::string> row{name_of(bond.bond), run_row_label(bond, first, end)};
  for (const double share : mean.shares) row.push_back(tenths(100.0 * share));
  row.push_back(tenths(100.0 * mean.largest));
  return row;
}

}  // namespace

std::vector<std::vector<SweepResult>> series_of(const std::vector<SweepResult>& results) {
  const auto grouped = [&results](auto same) {
    std::vector<std::vector<SweepResult>> series;
    for (const SweepResult& result : results) {
      if (series.empty() || !same(series.back().front().point, result.point)) series.emplace_back();
      series.back().push_back(result);
    }
    return series;
  };
  const auto same_kind = [](const SweepPoint& a, const SweepPoint& b) {
    return a.bond == b.bond && a.map == b.map;
  };
  std::vector<std::vector<SweepResult>> over_bodies =
      grouped([&](const SweepPoint& a, const SweepPoint& b) {
        return same_kind(a, b) && a.worlds == b.worlds;
      });
  const bool has_any = std::ranges::any_of(over_bodies, [](const auto& s) { return s.size() > 1; });
  return has_any ? over_bodies : grouped(same_kind);
}

bool is_off(const SweepResult& result) { return result.most_points_off > kFigurePoints; }

std::string groups_text(const SweepReport& report) {
  std::vector<std::vector<std::string>> rows;
  for (const SweepResult& result : report.results) {
    const SweepPoint& point = result.point;
    std::vector<std::string>& row =
        rows.emplace_back(std::vector<std::string>{name_of(point.bond), name_of(point.map)});
    row.push_back(std::to_string(point.bodies));
    row.push_back(std::to_string(point.worlds));
    for (const MeanOfSeeds& share : result.shares) row.push_back(per_cent(share));
    row.push_back(per_cent(result.largest));
    row.push_back(known_text(point.known));
    row.push_back(point.known == nullptr ? "-" : tenths(result.most_points_off));
  }
  std::vector<Column> columns =
      class_columns({{"by"}, {"map"}, {"bodies", Align::kRight}, {"worlds", Align::kRight}});
  for (const char* title : {"largest", "known", "most off"})
    columns.push_back({title, Align::kRight});
  return title_of(report) + "\n% of the worlds in synchronisation groups of so many worlds, " +
         "with the 95 % confidence of the mean\n\n" + format_table(columns, rows) + "\n" +
         checked_text(report) + thresholds_text(report);
}

std::string groups_text(const RunGroupsReport& report) {
  std::vector<std::vector<std::string>> rows;
  for (const BondOverTime& bond : report.bonds) {
    const std::size_t steps = bond.steps.size(), parts = std::min(kRowsOfRun, steps);
    for (std::size_t part = 0; part < parts; ++part)
      rows.push_back(row_of_steps(bond, steps * part / parts, steps * (part + 1) / parts));
    if (parts > 1) rows.push_back(row_of_steps(bond, 0, steps));
  }
  std::vector<Column> columns = class_columns({{"by"}, {"steps", Align::kRight}});
  columns.push_back({"largest", Align::kRight});
  return report.scenario + ": " + std::to_string(report.worlds) +
         " worlds\n% of the worlds in synchronisation groups of so many worlds, mean over the "
         "steps\n\n" +
         format_table(columns, rows);
}

std::string groups_json(const SweepReport& report) {
  return JsonObject()
             .set("preset", report.name.empty() ? "null" : quoted(report.name))
             .set("first_seed", json_of(report.seeds.first))
             .set("last_seed", json_of(report.seeds.last))
             .set("points", list_of(report.results, result_json))
             .text() +
         "\n";
}

std::string groups_json(const RunGroupsReport& report) {
  const auto bond_json = [](const BondOverTime& bond) {
    return JsonObject()
        .set("by", quoted(name_of(bond.bond)))
        .set("steps", list_of(bond.steps,
                              [](const StepGroups& step) {
                                return JsonObject()
                                    .set("step", json_of(step.step))
                                    .set("shares", shares_object(step.shares).text())
                                    .set("largest", json_of(step.largest))
                                    .text();
                              }))
        .text();
  };
  return JsonObject()
             .set("scenario", quoted(report.scenario))
             .set("worlds", json_of(report.worlds))
             .set("bonds", list_of(report.bonds, bond_json))
             .text() +
         "\n";
}

std::string groups_csv(const SweepReport& report) {
  std::string text = "by,map,bodies,worlds";
  for (const char* name : kGroupClassNames)
    text += std::string(",") + name + "," + name + "_half_width";
  text += ",largest,largest_half_width,others,others_half_width,points_off\n";
  const auto number = [](double value) {
    return "," + (std::isnan(value) ? std::string() : format_exact(value));
  };
  for (const SweepResult& result : report.results) {
    const SweepPoint& point = result.point;
    text += std::string(name_of(point.bond)) + "," + name_of(point.map) + "," +
            std::to_string(point.bodies) + "," + std::to_string(point.worlds);
    for (const MeanOfSeeds& share : result.shares)
      text += number(share.mean) + number(share.half_width);
    for (const MeanOfSeeds& mean : {result.largest, result.others})
      text += number(mean.mean) + number(mean.half_width);
    text += number(result.most_points_off) + "\n";
  }
  return text;
}

std::string groups_csv(const RunGroupsReport& report) {
  std::string text = "by,step";
  for (const char* name : kGroupClassNames) text += std::string(",") + name;
  text += ",largest\n";
  for (const BondOverTime& bond : report.bonds) {
    for (const StepGroups& step : bond.steps) {
      text += std::string(name_of(bond.bond)) + "," + std::to_string(step.step);
      for (const double share : step.shares) text += "," + format_exact(share);
      text += "," + format_exact(step.largest) + "\n";
    }
  }
  return text;
}

}  // namespace soda::analysis
