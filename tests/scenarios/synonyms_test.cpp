// Names that users bring along from elsewhere.
#include "scenarios/synonyms.hpp"

#include <gtest/gtest.h>

#include <set>
#include <sstream>

#include "scenarios/reference.hpp"
#include "tests/scenarios/scenario_texts.hpp"

namespace soda::scenarios {
namespace {

std::vector<std::string> words_of(std::string_view text) {
  std::istringstream in{std::string(text)};
  return {std::istream_iterator<std::string>(in), {}};
}

// Keys of each object, and names that may stand in one place.
std::vector<std::vector<std::string_view>> places() {
  std::vector<std::vector<std::string_view>> all;
  for (const TaggedTable& table : all_tables()) {
    std::vector<std::string_view>& keys = all.emplace_back();
    for (const Field& field : table.table->fields) keys.push_back(field.key);
  }
  for (const TaggedTable& table : all_tables())
    for (const Field& field : table.table->fields)
      if (!field.names.empty()) all.emplace_back(field.names.begin(), field.names.end());
  for (const ChoiceTable* choice : all_choices()) {
    std::vector<std::string_view>& names = all.emplace_back();
    for (const ChoiceEntry& entry : choice->entries) names.push_back(entry.name);
  }
  return all;
}

TEST(Synonyms, EachWordStandsOnceAndEachNameIsOneOfTheFormat) {
  std::set<std::string> words, known;
  for (const auto& place : places()) known.insert(place.begin(), place.end());
  for (const Synonym& synonym : synonyms()) {
    for (const std::string& word : words_of(synonym.words))
      EXPECT_TRUE(words.insert(word).second) << word;
    for (const std::string& name : words_of(synonym.names))
      EXPECT_TRUE(known.contains(name)) << name;
  }
}

TEST(Synonyms, EachWordGetsItsNameWhereverThatMayStand) {
  for (const Synonym& synonym : synonyms())
    for (const std::string& word : words_of(synonym.words))
      for (const auto& place : places()) {
        const auto is_known = [&](const std::string& name) {
          return std::ranges::find(place, name) != place.end();
        };
        const auto names = words_of(synonym.names);
        const auto name = std::ranges::find_if(names, is_known);
        if (name == names.end()) continue;
        EXPECT_TRUE(name_hint(word, place).starts_with("did you mean \"" + *name + "\"?"))
            << word << ": " << name_hint(word, place);
      }
}

struct Meant {
  const char* name;
  std::string_view from, to;
  const char* hint;  // part of it
};

void PrintTo(const Meant& meant, std::ostream* out) { *out << meant.name; }

class WordOfAUser : public testing::TestWithParam<Meant> {};

TEST_P(WordOfAUser, IsAnErrorThatSaysTheNameHere) {
  const Meant& meant = GetParam();
  std::string hints;
  for (const InputFault& fault : faults_of(replaced(kSmallScenario, meant.from, meant.to)))
    hints += fault.hint + "\n";
  EXPECT_NE(hints.find(meant.hint), std::string::npos) << hints;
}

#define SODA_JOINT(type) \
  "\"format\": 1, \"joints\": [{\"type\": \"" type "\", \"id\": 1, \"body\": 7}]"

const Meant kMeant[] = {
    {"Plane", "\"halfspace\"", "\"plane\"", "did you mean \"halfspace\"?"},
    {"PlaneThatMoves", "\"type\": \"box\", \"size_m\": [1, 2, 3]", "\"type\": \"plane\"",
     "did you mean \"halfspace\"? everything below a plane; among statics only"},
    {"Revolute", "\"format\": 1", SODA_JOINT("revolute"), "did you mean \"hinge\"?"},
    {"Prismatic", "\"format\": 1", SODA_JOINT("prismatic"), "did you mean \"slider\"?"},
    {"Weld", "\"format\": 1", SODA_JOINT("weld"), "did you mean \"fixed\"?"},
    {"Spherical", "\"format\": 1", SODA_JOINT("Spherical"), "did you mean \"ball\"?"},
    {"HalfExtents", "\"size_m\"", "\"half_extents_m\"",
     "did you mean \"size_m\"? full edge lengths: twice the half extents"},
    {"HalfExtentsInCamels", "\"size_m\"", "\"halfExtents\"", "did you mean \"size_m\"?"},
    {"MassOfZero", "\"mass_kg\": 2", "\"mass_kg\": 0", "stands under statics, without a mass"},
    {"Mass", "\"mass_kg\": 2", "\"mass\": 2", "did you mean \"mass_kg\"?"},
    {"Pos", "\"position_m\": [0, 0, 5]", "\"pos\": [0, 0, 5]", "did you mean \"position_m\"?"},
    {"Position", "\"position_m\": [0, 0, 5]", "\"position\": [0, 0, 5]",
     "did you mean \"position_m\"?"},
    {"Rotation", "\"orientation\": {\"w\"", "\"rotation\": {\"w\"",
     "did you mean \"orientation\"?"},
    {"Quaternion", "\"orientation\": {\"w\"", "\"quaternion\": {\"w\"",
     "did you mean \"orientation\"?"},
    {"QuaternionAsArray", "{\"w\": 1, \"x\": 0, \"y\": 0, \"z\": 0}", "[1, 0, 0, 0]",
     "write {\"w\": ..."},
    {"Dt", "\"time_step_s\"", "\"dt\"", "did you mean \"time_step_s\"?"},
    {"Timestep", "\"time_step_s\"", "\"timestep\"", "did you mean \"time_step_s\"?"},
    {"Gravity", "\"gravity_m_s2\"", "\"gravity\"", "did you mean \"gravity_m_s2\"?"},
    {"GravityAsNumber", "[0, 0, -9.81]", "-9.81", "as a vector, such as [0, 0, -9.81]"},
    {"Height", "\"type\": \"box\", \"size_m\": [1, 2, 3]",
     "\"type\": \"capsule\", \"radius_m\": 1, \"height\": 2", "did you mean \"length_m\"?"},
    {"ShapeAsName", "{\"type\": \"box\", \"size_m\": [1, 2, 3]}", "\"box\"",
     "write {\"type\": \"box\", ...} with its sizes"},
};

INSTANTIATE_TEST_SUITE_P(All, WordOfAUser, testing::ValuesIn(kMeant),
                         [](const auto& each) { return each.param.name; });

TEST(Synonyms, OfAWordNearAKnownNameTheNearestIsStillNamed) {
  const std::string_view known[] = {"mass_kg", "material"};
  EXPECT_EQ(name_hint("mas_kg", known), "did you mean \"mass_kg\"?");
  EXPECT_EQ(name_hint("colour", known), "");
}

}  // namespace
}  // namespace soda::scenarios
