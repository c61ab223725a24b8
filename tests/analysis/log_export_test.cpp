// `soda log --vtk` and its lines of states and worlds, through the binary: files that other
// programs read hold the numbers of the log.
#include <gtest/gtest.h>

#include <boost/property_tree/xml_parser.hpp>
#include <cstring>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "analysis/child_process.hpp"
#include "analysis/event_log/log_reader.hpp"
#include "analysis/forged_log.hpp"
#include "analysis/text/exit_codes.hpp"

namespace soda::analysis {
namespace {

using analysis_test::ChildResult;
using analysis_test::contains;
using analysis_test::library_file;
using analysis_test::read_file;
using analysis_test::rewrite_log;
using analysis_test::run_soda;
using analysis_test::TemporaryFolder;
using analysis_test::write_file;
using boost::property_tree::ptree;
using Json = nlohmann::json;

ptree xml_of(const std::string& file) {
  ptree tree;
  boost::property_tree::read_xml(file, tree);
  return tree;
}

std::vector<unsigned char> bytes_of_base64(const std::string& text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::vector<unsigned char> bytes;
  unsigned bits = 0, count = 0;
  for (const char letter : text) {
    const std::size_t digit = digits.find(letter);
    if (digit == std::string::npos) break;  // the padding
    bits = (bits << 6 | static_cast<unsigned>(digit)) & 0xffffu;
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes.push_back(static_cast<unsigned char>(bits >> count));
  }
  return bytes;
}

// The numbers of an array, which says how many bytes it has.
template <class T>
std::vector<T> numbers_of(const ptree& array) {
  const std::vector<unsigned char> bytes = bytes_of_base64(array.data());
  std::uint64_t count = 0;
  EXPECT_GE(bytes.size(), sizeof count);
  std::memcpy(&count, bytes.data(), sizeof count);
  EXPECT_EQ(bytes.size(), sizeof count + count);
  std::vector<T> numbers(count / sizeof(T));
  if (count > 0) std::memcpy(numbers.data(), bytes.data() + sizeof count, count);
  return numbers;
}

// A file of VTK, by the names of its arrays.
struct PolyData {
  explicit PolyData(const std::string& file) {
    const ptree tree = xml_of(file);
    EXPECT_EQ(tree.get<std::string>("VTKFile.<xmlattr>.byte_order"), "LittleEndian");
    EXPECT_EQ(tree.get<std::string>("VTKFile.<xmlattr>.header_type"), "UInt64");
    const ptree& piece = tree.get_child("VTKFile.PolyData.Piece");
    points = piece.get<std::size_t>("<xmlattr>.NumberOfPoints");
    vertices = piece.get<std::size_t>("<xmlattr>.NumberOfVerts");
    polygons = piece.get<std::size_t>("<xmlattr>.NumberOfPolys");
    for (const auto& [part, children] : piece)
      for (const auto& [kind, array] : children)
        if (kind == "DataArray") arrays[array.get<std::string>("<xmlattr>.Name")] = array;
    for (const auto& [kind, array] : tree.get_child("VTKFile.PolyData.FieldData"))
      fields[array.get<std::string>("<xmlattr>.Name")] = array.data();
  }
  template <class T>
  std::vector<T> get(const std::string& name) const {
    EXPECT_TRUE(arrays.contains(name)) << name;
    return numbers_of<T>(arrays.at(name));
  }
  std::size_t points = 0, vertices = 0, polygons = 0;
  std::map<std::string, ptree> arrays;
  std::map<std::string, std::string> fields;
};

// A table with a line of names, as rows by name.
std::vector<std::map<std::string, std::string>> rows_of(const std::string& csv) {
  std::istringstream lines(csv);
  std::vector<std::string> names;
  std::vector<std::map<std::string, std::string>> rows;
  for (std::string line; std::getline(lines, line);) {
    std::vector<std::string> cells(1);
    for (const char letter : line) letter == ',' ? cells.emplace_back() : cells.back() += letter;
    if (names.empty()) {
      names = cells;
      continue;
    }
    EXPECT_EQ(cells.size(), names.size()) << line;
    auto& row = rows.emplace_back();
    for (std::size_t i = 0; i < names.size(); ++i) row[names[i]] = cells.at(i);
  }
  return rows;
}

class LogExport : public testing::Test {
 protected:
  ChildResult traced(const std::string& scene, std::vector<std::string> options) {
    options.insert(options.begin(), {"run", library_file(scene), "--executor", "virtual", "--log",
                                     log_, "--log-level", "trace", "--json"});
    const ChildResult ran = run_soda(options);
    EXPECT_EQ(ran.exit_code, kExitOk) << ran.err;
    return ran;
  }
  std::string made(const std::string& name) const { return vtk_ + "/" + name; }

  const TemporaryFolder folder_;
  const std::string log_ = folder_.file("run.sodalog"), vtk_ = folder_.file("vtk");
};

TEST_F(LogExport, FilesForParaviewHoldTheStatesOfTheLogBitForBit) {
  traced("ragdolls", {"--steps", "50"});
  const ChildResult ran = run_soda({"log", log_, "--vtk", vtk_, "--every", "20"});
  ASSERT_EQ(ran.exit_code, kExitOk) << ran.err;
  LogReader log(log_);
  const ptree collection = xml_of(made("bodies.pvd"));
  std::vector<std::int64_t> steps;
  for (const auto& [kind, set] : collection.get_child("VTKFile.Collection")) {
    const PolyData data(made(set.get<std::string>("<xmlattr>.file")));
    steps.push_back(std::stoll(data.fields.at("step")));
    const LoggedStep logged = log.read_states(steps.back());
    EXPECT_EQ(set.get<double>("<xmlattr>.timestep"),
              static_cast<double>(steps.back()) * log.scenario().dt_s);
    ASSERT_EQ(data.points, logged.ids.size());
    EXPECT_EQ(data.vertices, data.points);
    const auto places = data.get<double>("points_m");
    const auto turns = data.get<double>("orientation_wxyz");
    const auto velocities = data.get<double>("linear_velocity_m_s");
    const auto spins = data.get<double>("angular_velocity_rad_s");
    const auto labels = data.get<std::int64_t>("body");
    ASSERT_EQ(data.get<std::int32_t>("connectivity").size(), data.points);
    ASSERT_EQ(turns.size(), 4 * data.points);
    ASSERT_EQ(spins.size(), 3 * data.points);
    for (std::size_t i = 0; i < data.points; ++i) {
      const physics::BodyState& state = logged.states[i];
      for (std::size_t k = 0; k < 3; ++k) {
        ASSERT_EQ(places.at(3 * i + k), state.position_m[static_cast<int>(k)]);
        ASSERT_EQ(velocities.at(3 * i + k), state.linear_velocity_m_s[static_cast<int>(k)]);
        ASSERT_EQ(spins.at(3 * i + k), state.angular_velocity_rad_s[static_cast<int>(k)]);
        ASSERT_EQ(turns.at(4 * i + 1 + k), state.orientation.vec()[static_cast<int>(k)]);
      }
      ASSERT_EQ(turns.at(4 * i), state.orientation.w());
      ASSERT_EQ(labels.at(i), log.labels()[physics::index_of(logged.ids[i])]);
    }
  }
  EXPECT_EQ(steps, (std::vector<std::int64_t>{0, 20, 40, 50}));
  // Each doll is an island of its own by its joints, until dolls touch.
  const auto islands = PolyData(made("bodies-000000.vtp")).get<std::int64_t>("island");
  EXPECT_EQ(std::set(islands.begin(), islands.end()).size(), 3u);
}

TEST_F(LogExport, ContactPointsBearWhatSodaContactsTells) {
  traced("border-stack", {"--steps", "40"});
  ASSERT_EQ(run_soda({"log", log_, "--vtk", vtk_, "--every", "40"}).exit_code, kExitOk);
  const auto rows = rows_of(run_soda({"contacts", log_, "--csv"}).out);
  const PolyData data(made("contacts-000040.vtp"));
  const auto places = data.get<double>("points_m"), forces = data.get<double>("force_newton");
  const auto presses = data.get<double>("normal_newton");
  const auto others = data.get<std::int64_t>("other"), statics = data.get<std::int64_t>("static");
  std::size_t at = 0;
  for (const auto& row : rows) {
    if (row.at("x_m").empty()) continue;  // come apart
    ASSERT_LT(at, data.points);
    const char *kPlaces[] = {"x_m", "y_m", "z_m"},
               *kForces[] = {"fx_newton", "fy_newton", "fz_newton"};
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(places.at(3 * at + k), std::stod(row.at(kPlaces[k])));
      EXPECT_EQ(forces.at(3 * at + k), std::stod(row.at(kForces[k])));
    }
    EXPECT_EQ(presses.at(at), std::stod(row.at("normal_newton")));
    EXPECT_NE(others.at(at) == -1, statics.at(at) == -1);
    if (others.at(at) != -1) {
      EXPECT_EQ(std::to_string(others.at(at)), row.at("other"));
    }
    ++at;
  }
  EXPECT_EQ(at, data.points);
  EXPECT_GT(at, 20u);
  EXPECT_EQ(PolyData(made("contacts-000000.vtp")).points, 0u);  // nothing bears anything yet
}

TEST_F(LogExport, SurfacesOfBoxesAreTheirEightCornersWhereTheyAre) {
  const std::string scene = folder_.file("box.json");
  write_file(scene, R"({"format": 1, "gravity_m_s2": [0, 0, 0], "time_step_s": 0.01, "steps": 30,
"materials": [{"name": "m", "friction": 0.5, "restitution": 0}],
"bodies": [{"id": 7, "shape": {"type": "box", "size_m": [2, 4, 6]}, "mass_kg": 2, "material": "m",
 "position_m": [1, 2, 3], "angular_velocity_rad_s": [1, 2, 3]}]})");
  ASSERT_EQ(run_soda({"run", scene, "--log", log_}).exit_code, kExitOk);
  ASSERT_EQ(run_soda({"log", log_, "--vtk", vtk_, "--surfaces", "--every", "30"}).exit_code,
            kExitOk);
  const PolyData data(made("surfaces-000030.vtp"));
  ASSERT_EQ(data.points, 8u);
  ASSERT_EQ(data.polygons, 12u);
  EXPECT_EQ(data.get<std::int64_t>("body"), std::vector<std::int64_t>(12, 7));
  LogReader log(log_);
  const physics::BodyState state = log.read_states(30).states.at(0);
  const auto places = data.get<float>("points_m");
  for (std::size_t i = 0; i < 8; ++i) {
    const physics::Vec3 at(places[3 * i], places[3 * i + 1], places[3 * i + 2]);
    const physics::Vec3 own = state.orientation.conjugate() * (at - state.position_m);
    EXPECT_LT((own.cwiseAbs() - physics::Vec3(1, 2, 3)).norm(), 2e-6);
  }
  // Outwards: the sum of the tetrahedra below the triangles is the volume.
  const auto corners = data.get<std::int32_t>("connectivity");
  const auto corner = [&](std::size_t i) {
    const auto at = 3 * static_cast<std::size_t>(corners.at(i));
    return physics::Vec3(places.at(at), places.at(at + 1), places.at(at + 2));
  };
  double volume = 0.0;
  for (std::size_t i = 0; i + 2 < corners.size(); i += 3)
    volume += corner(i).dot(corner(i + 1).cross(corner(i + 2))) / 6.0;
  EXPECT_NEAR(volume, 48.0, 1e-4);
}

TEST_F(LogExport, AFolderIsWrittenWholeAndReplacesNothingElse) {
  traced("border-stack", {"--steps", "4"});
  ASSERT_EQ(run_soda({"log", log_, "--vtk", vtk_ + "/"}).exit_code, kExitOk);
  const std::string first = read_file(made("bodies-000004.vtp"));
  const ChildResult again = run_soda({"log", log_, "--vtk", vtk_});
  EXPECT_EQ(again.exit_code, kExitFile);
  EXPECT_TRUE(contains(again.err, "--force replaces it")) << again.err;
  EXPECT_EQ(run_soda({"log", log_, "--vtk", vtk_, "--force", "--every", "4"}).exit_code, kExitOk);
  EXPECT_EQ(read_file(made("bodies-000004.vtp")), first);  // same log, same bytes
  EXPECT_FALSE(std::filesystem::exists(made("bodies-000003.vtp")));
  write_file(made("notes.txt"), "mine");
  const ChildResult kept = run_soda({"log", log_, "--vtk", vtk_, "--force"});
  EXPECT_EQ(kept.exit_code, kExitFile);
  EXPECT_TRUE(contains(kept.err, "notes.txt")) << kept.err;
  EXPECT_EQ(read_file(made("notes.txt")), "mine");
  EXPECT_EQ(run_soda({"log", log_, "--vtk", log_, "--force"}).exit_code, kExitFile);
  EXPECT_EQ(run_soda({"log", log_, "--vtk", folder_.file("no/such/folder")}).exit_code, kExitFile);
  for (const std::string& name : folder_.files()) EXPECT_FALSE(contains(name, ".partial")) << name;
}

TEST_F(LogExport, LinesOfWorldsAddUpToWhatTheRunCounted) {
  const Json run = Json::parse(
      traced("border-stack", {"--steps", "150", "--gating", "off", "--latency-us", "60"}).out);
  const ChildResult told = run_soda({"log", log_, "--csv", "--lines", "worlds"});
  ASSERT_EQ(told.exit_code, kExitOk) << told.err;
  std::map<std::string, std::uint64_t> sums;
  const auto rows = rows_of(told.out);
  EXPECT_EQ(rows.size(), 150u * 4);
  double lead = 0.0;
  for (const auto& row : rows) {
    for (const char* name : {"executed", "rolled_back", "committed", "late"})
      sums[name] += std::stoull(row.at(name));
    if (row.at("step") == "100") sums["bodies"] += std::stoull(row.at("bodies"));
    lead = std::max(lead, std::stod(row.at("lead_steps")));
    EXPECT_LE(std::stod(row.at("began_s")), std::stod(row.at("finished_s")));
    EXPECT_LE(std::stod(row.at("finished_s")), std::stod(row.at("committed_s")));
    EXPECT_GE(std::stoll(row.at("buffer_entries")), 1);
  }
  EXPECT_GT(sums["rolled_back"], 1000u);
  EXPECT_EQ(sums["executed"], run["events"]["executed"]);
  EXPECT_EQ(sums["rolled_back"], run["events"]["rolled_back"]);
  EXPECT_EQ(sums["committed"], run["events"]["committed"]);
  EXPECT_EQ(sums["late"], run["events"]["stragglers"]);
  EXPECT_EQ(sums["bodies"], 11u);
  EXPECT_GT(lead, 5.0);
}

TEST_F(LogExport, LinesOfStatesAreThoseOfTheBodiesThatAreAskedFor) {
  traced("border-stack", {"--steps", "20"});
  const auto rows = rows_of(
      run_soda({"log", log_, "--csv", "--lines", "states", "--body", "3", "--body", "100"}).out);
  ASSERT_EQ(rows.size(), 2u * 21);
  LogReader log(log_);
  const LoggedStep last = log.read_states(20);
  EXPECT_EQ(rows.back().at("body"), "100");
  EXPECT_EQ(std::stod(rows.back().at("z_m")), last.states.back().position_m.z());
  EXPECT_EQ(std::stod(rows.back().at("vz_m_s")), last.states.back().linear_velocity_m_s.z());
  EXPECT_EQ(std::stod(rows.back().at("time_s")), 20 * log.scenario().dt_s);
  const std::vector<std::pair<std::vector<std::string>, std::string>> wrong = {
      {{"--body", "3"}, "--body: needs --lines states"},
      {{"--csv", "--lines", "states", "--body", "99"}, "has no body 99"},
      {{"--surfaces"}, "--surfaces: needs --vtk"},
      {{"--every", "2"}, "--every: needs --vtk"},
      {{"--lines", "worlds"}, "needs --csv or --json"},
      {{"--csv", "--vtk", vtk_}, "excludes"}};
  for (const auto& [options, part] : wrong) {
    std::vector<std::string> line = {"log", log_};
    line.insert(line.end(), options.begin(), options.end());
    const ChildResult told = run_soda(line);
    EXPECT_EQ(told.exit_code, kExitInput) << part;
    EXPECT_TRUE(contains(told.err, part)) << told.err;
    EXPECT_EQ(told.out, "") << part;
  }
}

TEST_F(LogExport, ImpulsesOfWhatIsNotThereAreTold) {
  traced("border-stack", {"--steps", "20"});
  const std::string forged = folder_.file("forged.sodalog");
  for (const std::uint32_t other : {11u, 0x7fffffffu, 0x80000040u, 0xffffffffu}) {
    rewrite_log(log_, forged, [&](LoggedStep& step) {
      for (physics::BodyState& state : step.states)
        for (physics::ContactImpulse& impulse : state.impulses)
          if (step.step == 20) impulse.other = physics::BodyId{other};
    });
    for (const std::vector<std::string>& options :
         {std::vector<std::string>{"contacts", forged, "--csv"},
          {"log", forged, "--vtk", vtk_},
          {"log", forged, "--csv", "--lines", "worlds"}}) {
      const ChildResult told = run_soda(options);
      EXPECT_EQ(told.exit_code, kExitFile) << options[0] << " signal " << told.signal;
      EXPECT_TRUE(contains(told.err, "has an impulse with a body, static or joint")) << told.err;
    }
  }
}

}  // namespace
}  // namespace soda::analysis
