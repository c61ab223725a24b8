// The reader and the JSON Schema come from the same tables: a file that one takes, the other takes.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validator.hpp>

#include "scenarios/random.hpp"
#include "tests/scenarios/scenario_texts.hpp"

namespace soda::scenarios {
namespace {

using nlohmann::json;

class CommittedSchema {
 public:
  CommittedSchema() {
    const json document = json::parse(
        file_bytes(std::filesystem::path(SODA_SOURCE_DIR) / "scenarios/scenario.schema.json"));
    valijson::adapters::NlohmannJsonAdapter adapter(document);
    valijson::SchemaParser().populateSchema(adapter, schema_);
  }
  bool takes(const json& document) {
    valijson::adapters::NlohmannJsonAdapter adapter(document);
    return valijson::Validator().validate(schema_, adapter, nullptr);
  }

 private:
  valijson::Schema schema_;
};

// Pointers of all values but the root.
void collect(const json& value, const json::json_pointer& at,
             std::vector<json::json_pointer>& out) {
  if (value.is_object()) {
    for (const auto& [key, member] : value.items()) {
      out.push_back(at / key);
      collect(member, at / key, out);
    }
  } else if (value.is_array()) {
    for (std::size_t i = 0; i < value.size(); ++i) {
      out.push_back(at / i);
      collect(value[i], at / i, out);
    }
  }
}

// Values of these keys also have to agree with other parts of the file, or to have a shape, which a
// schema cannot say: only edits that break their type are made there.
bool has_cross_checks(const json::json_pointer& at) {
  static const std::vector<std::string> keys = {"id",
                                                "body",
                                                "other",
                                                "other_body",
                                                "other_anchor_m",
                                                "first_id",
                                                "name",
                                                "material",
                                                "drive",
                                                "way_points_m",
                                                "duration_s",
                                                "time_step_s",
                                                "worlds",
                                                "cells",
                                                "count",
                                                "rows",
                                                "points_m",
                                                "normal",
                                                "axis",
                                                "w",
                                                "x",
                                                "y",
                                                "z",
                                                "region_min_m",
                                                "min_gap_m",
                                                "region_max_m",
                                                "density_kg_m3",
                                                "position_m",
                                                "file",
                                                "size_m",
                                                "radius_m",
                                                "length_m",
                                                "vertices_m",
                                                "triangles",
                                                "gap_m",
                                                "side_gap_m",
                                                "spacing_m"};
  for (json::json_pointer p = at; !p.empty(); p = p.parent_pointer()) {
    if (std::find(keys.begin(), keys.end(), p.back()) != keys.end()) return true;
  }
  return false;
}

json number_edit(RandomStream& stream) {
  const json candidates[] = {0,
                             1,
                             -1,
                             2,
                             7,
                             1000,
                             1001,
                             0.5,
                             -0.25,
                             1.5,
                             1e-7,
                             1e-5,
                             1e7,
                             1e9,
                             1.5e9,
                             1e10,
                             1e13,
                             2147483648,
                             1e300,
                             1.0,
                             100.0,
                             -1e9,
                             1024,
                             1025,
                             9007199254740992,
                             9007199254740993};
  return candidates[next_bits(stream) % std::size(candidates)];
}

json any_value(RandomStream& stream) {
  const json candidates[] = {nullptr,
                             true,
                             false,
                             "",
                             "grid",
                             "threads",
                             json::array(),
                             json::object(),
                             json::array({1, 2, 3}),
                             json::array({1, 2}),
                             -5,
                             0.125};
  return candidates[next_bits(stream) % std::size(candidates)];
}

// One edit of the document, or none if it would meet a cross-check.
std::optional<json> edited(const json& original, const std::vector<json::json_pointer>& places,
                           RandomStream& stream) {
  json document = original;
  const json::json_pointer& at = places[next_bits(stream) % places.size()];
  json& value = document[at];
  switch (next_bits(stream) % 5) {
    case 0:
      if (value.is_number() && !has_cross_checks(at)) {
        value = number_edit(stream);
        return document;
      }
      return std::nullopt;
    case 1: {
      const json other = any_value(stream);
      const bool checked = has_cross_checks(at) || at.back() == "materials" ||
                           at.back() == "drives" || at.back() == "joints";
      if (checked && (other.is_number() || other.type() == value.type() || other.is_string() ||
                      at.back() == "file")) {
        return std::nullopt;
      }
      value = other;
      return document;
    }
    case 2: {
      json& parent = document[at.parent_pointer()];
      // A material, drive or joint that is gone may be missed elsewhere.
      for (const char* named : {"materials", "drives", "joints"}) {
        if (at.parent_pointer().to_string() == std::string("/") + named || at.back() == named) {
          return std::nullopt;
        }
      }
      if (parent.is_object()) {
        const bool mesh = at.back() == "file" || at.back() == "unit_m";
        const bool territory = at.back() == "territory";
        const bool motor = at.back().starts_with("motor_");  // speed and push go together
        if (mesh || territory || motor || at.back() == "normal") return std::nullopt;
        parent.erase(at.back());
      } else {
        // Inputs name bodies.
        if (at.parent_pointer().back() == "bodies" && document.contains("inputs"))
          return std::nullopt;
        if (has_cross_checks(at) && parent.size() != 3) return std::nullopt;
        parent.erase(std::stoul(at.back()));
      }
      return document;
    }
    case 3:
      if (!value.is_object()) return std::nullopt;
      value["unknown_key"] = any_value(stream);
      return document;
    default: {
      json& parent = document[at.parent_pointer()];
      if (!parent.is_object()) return std::nullopt;
      const json moved = value;
      parent.erase(at.back());
      parent[at.back() + "x"] = moved;
      return document;
    }
  }
}

bool reader_takes(const json& document, const std::string& file, std::string& why) {
  try {
    read_scenario_text(document.dump(), file);
    return true;
  } catch (const InputError& error) {
    why = error.what();
    return false;
  }
}

TEST(SchemaAndReader, BothTakeEveryLibraryFile) {
  CommittedSchema schema;
  for (const auto& file : library_files()) {
    EXPECT_TRUE(schema.takes(json::parse(file_bytes(file)))) << file;
    EXPECT_NO_THROW(read_scenario_file(file.string())) << file;
  }
}

TEST(SchemaAndReader, AgreeOnEditedLibraryFiles) {
  CommittedSchema schema;
  int taken = 0, refused = 0;
  std::vector<std::pair<json, std::string>> documents;
  for (const auto& file : library_files()) {
    documents.emplace_back(json::parse(file_bytes(file)), file.string());
  }
  for (const auto& file : case_files()) {
    documents.emplace_back(json::parse(file_bytes(file)), file.string());
  }
  documents.emplace_back(json::parse(kSmallScenario), "small.json");
  for (const auto& [original, file] : documents) {
    std::vector<json::json_pointer> places;
    collect(original, json::json_pointer(), places);
    // What names bodies makes edits of bodies, and of those names, meet a cross-check.
    for (const std::string key : {"references", "joints"}) {
      if (!original.contains(key)) continue;
      std::erase_if(places, [&key](const json::json_pointer& at) {
        return !at.to_string().starts_with("/" + key);
      });
      break;  // references name joints, too
    }
    RandomStream stream = make_stream(2, places.size());
    for (int i = 0; i < 400; ++i) {
      const std::optional<json> document = edited(original, places, stream);
      if (!document) continue;
      std::string why;
      const bool reader = reader_takes(*document, file, why), by_schema = schema.takes(*document);
      ASSERT_EQ(reader, by_schema) << file << " edit " << i << ": " << why << "\n"
                                   << json::diff(original, *document).dump();
      ++(reader ? taken : refused);
    }
  }
  RecordProperty("taken", taken);
  RecordProperty("refused", refused);
  // Both outcomes must be common, or the agreement says little.
  EXPECT_GT(taken, 200);
  EXPECT_GT(refused, 1000);
}

}  // namespace
}  // namespace soda::scenarios
