#include "analysis/commands/contacts_command.hpp"

#include <algorithm>
#include <ostream>

#include "analysis/commands/search_json.hpp"
#include "analysis/event_log/log_reader.hpp"
#include "analysis/event_log/logged_run.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/text_table.hpp"

namespace soda::analysis {
namespace {

using physics::ContactLoad;

// What acts on b as a whole.
physics::Vec3 force_newton(const ContactLoad& load) {
  return load.normal * load.normal_newton + load.friction_newton;
}

std::string name_in(physics::BodyId id, const ContactNames& names) {
  return physics::is_static(id) ? names.statics[physics::static_index_of(id)]
                                : std::to_string(names.labels[physics::index_of(id)]);
}

// A name with commas or quotes in it, as a field of CSV.
std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string field = "\"";
  for (const char letter : text) field += letter == '"' ? "\"\"" : std::string(1, letter);
  return field + "\"";
}

constexpr const char* kCsvHead =
    "step,body,other,x_m,y_m,z_m,nx,ny,nz,depth_m,normal_newton,friction_newton,fx_newton,"
    "fy_newton,fz_newton\n";

std::string csv_rows(const StepContacts& contacts, const ContactNames& names) {
  std::string text;
  const auto vector = [&text](const physics::Vec3& v) {
    for (int i = 0; i < 3; ++i) text += "," + format_exact(v[i]);
  };
  for (const ContactLoad& load : contacts.loads) {
    text += std::to_string(contacts.step) + "," + name_in(load.a, names) + "," +
            csv_field(name_in(load.b, names));
    if (load.point) {
      vector(load.point->position_m);
      vector(load.normal);
      text += "," + format_exact(-load.point->separation_m);
    } else {
      text += ",,,,,,,";
    }
    text +=
        "," + format_exact(load.normal_newton) + "," + format_exact(load.friction_newton.norm());
    if (load.point)
      vector(force_newton(load));
    else
      text += ",,,";
    text += "\n";
  }
  return text;
}

std::string table_text(const StepContacts& contacts, const ContactNames& names) {
  std::vector<Column> columns = {{"body", Align::kRight}, {"other"}};
  for (const char* title :
       {"x m", "y m", "z m", "depth m", "normal N", "friction N", "fx N", "fy N", "fz N"})
    columns.push_back({title, Align::kRight});
  std::vector<std::vector<std::string>> rows;
  for (const ContactLoad& load : contacts.loads) {
    std::vector<std::string>& row =
        rows.emplace_back(std::vector{name_in(load.a, names), name_in(load.b, names)});
    const auto add = [&row, &load](double number) {
      row.push_back(load.point ? format_number(number, 6) : "-");
    };
    const physics::ContactPoint point = load.point.value_or(physics::ContactPoint{});
    for (int i = 0; i < 3; ++i) add(point.position_m[i]);
    add(-point.separation_m);
    row.push_back(format_number(load.normal_newton, 6));
    row.push_back(format_number(load.friction_newton.norm(), 6));
    for (int i = 0; i < 3; ++i) add(force_newton(load)[i]);
  }
  return "step " + std::to_string(contacts.step) + ": " + std::to_string(rows.size()) +
         " contact points that bear something; forces act on the other\n\n" +
         (rows.empty() ? "" : format_table(columns, rows) + "\n");
}

std::vector<std::int64_t> steps_of(const ContactsRequest& request, const LogReader& log) {
  const std::int64_t last = log.last_step();
  if (request.step) {
    if (*request.step < log.first_step() || *request.step > last)
      throw UsageError("--step: found " + std::to_string(*request.step) +
                       "; allowed: " + std::to_string(log.first_step()) + " to " +
                       std::to_string(last) + ", the last whole step of " + request.file);
    return {*request.step};
  }
  if (!request.every) return {log.last_states()};
  std::vector<std::int64_t> steps;
  for (std::int64_t step = log.first_step(); step <= last; step += *request.every)
    if (has_states(log.options(), step)) steps.push_back(step);
  return steps;
}

}  // namespace

int contacts_command(const ContactsRequest& request, std::ostream& out, std::ostream& err) {
  LogReader log(request.file);
  tell_flaws(log, request.file, err);
  const scenarios::Scenario scenario = logged_scenario(log, {});
  const physics::Geometry geometry(scenario.scene);
  ContactNames names{log.labels(), {}};
  for (const physics::StaticBody& body : scenario.scene.statics) names.statics.push_back(body.name);
  std::optional<physics::BodyId> only;
  if (request.body) {
    const auto found = std::ranges::find(names.labels, *request.body);
    if (found == names.labels.end())
      throw UsageError("--body: " + request.file + " has no body " + std::to_string(*request.body));
    only = physics::BodyId{static_cast<std::uint32_t>(found - names.labels.begin())};
  }
  std::vector<StepContacts> all;
  if (request.csv) out << kCsvHead;
  for (const std::int64_t step : steps_of(request, log)) {
    const LoggedStep logged = log.read_states(step);
    require_numbers(log, logged);
    StepContacts contacts{
        step, physics::contact_loads(scenario.scene, geometry, logged.ids, logged.states)};
    if (only)
      std::erase_if(contacts.loads,
                    [&only](const ContactLoad& l) { return l.a != *only && l.b != *only; });
    if (request.json)
      all.push_back(std::move(contacts));
    else
      out << (request.csv ? csv_rows(contacts, names) : table_text(contacts, names));
  }
  if (request.json) out << contacts_json(all, names);
  return log.damage().empty() ? kExitOk : kExitCheckFailed;
}

}  // namespace soda::analysis
