#include <gtest/gtest.h>

#include "scenarios/faults.hpp"
#include "tests/scenarios/scenario_texts.hpp"

namespace soda::scenarios {
namespace {

// One edit of the small scenario. '@' in `to` marks where the fault must be found; it is taken out.
struct Breakage {
  const char* name;
  std::string_view from, to;
  const char* pointer;
  const char* found;    // part of the message
  const char* allowed;  // part of the message
};

void PrintTo(const Breakage& breakage, std::ostream* out) { *out << breakage.name; }

class LocatedFault : public testing::TestWithParam<Breakage> {};

TEST_P(LocatedFault, IsReportedOnceWithPlacePointerFoundAndAllowed) {
  const Breakage& broken = GetParam();
  std::string text = replaced(kSmallScenario, broken.from, broken.to);
  const std::size_t mark = text.find('@');
  ASSERT_NE(mark, std::string::npos);
  text.erase(mark, 1);
  const auto line_start = text.rfind('\n', mark == 0 ? 0 : mark - 1);
  const auto line = static_cast<std::size_t>(std::count(text.begin(), text.begin() + mark, '\n'));

  const std::vector<InputFault> faults = faults_of(text);
  ASSERT_EQ(faults.size(), 1u) << (faults.empty() ? "" : InputError("test", faults).what());
  EXPECT_EQ(faults[0].line, line + 1);
  EXPECT_EQ(faults[0].column, line == 0 ? mark + 1 : mark - line_start);
  EXPECT_EQ(faults[0].pointer, broken.pointer);
  EXPECT_NE(faults[0].found.find(broken.found), std::string::npos) << faults[0].found;
  EXPECT_NE(faults[0].allowed.find(broken.allowed), std::string::npos) << faults[0].allowed;
}

const Breakage kBreakages[] = {
    // What is known of the run.
    {"ReferenceToNobody", "\"format\": 1",
     "\"format\": 1, \"references\": [{\"type\": \"free-flight\", \"body\": @99}]",
     "/references/0/body", "99", "the id of a body of the scene"},
    {"ReferenceOfASphereToABox", "\"format\": 1",
     "\"format\": 1, \"references\": [{\"type\": \"bouncing\", \"body\": @7, \"restitution\": "
     "0.5}]",
     "/references/0/body", "no sphere", "the id of a sphere"},
    {"ReferenceWithAMeasureOfAnotherForm", "\"format\": 1",
     "\"format\": 1, \"references\": [{\"type\": \"at-rest\", \"must\": {@\"apex_m\": 1}}]",
     "/references/0/must/apex_m", "unknown key", "position_m"},
    {"ReferenceUnknown", "\"format\": 1",
     "\"format\": 1, \"references\": [{\"type\": @\"free-fall\", \"body\": 1}]",
     "/references/0/type", "free-fall", "free-flight"},
    {"ReferenceWithoutDirection", "\"format\": 1",
     "\"format\": 1, \"references\": [{\"type\": \"one-side\", \"normal\": @[0, 0, 0], "
     "\"offset_m\": "
     "0}]",
     "/references/0/normal", "length 0", "any length but zero"},
    // Types.
    {"FormatAsText", "\"format\": 1", "\"format\": @\"1\"", "/format", "\"1\"", "1"},
    {"FormatOfTheFuture", "\"format\": 1", "\"format\": @2", "/format", "2", "an integer 1"},
    {"FormatWithFraction", "\"format\": 1", "\"format\": @1.0", "/format", "1.0", "an integer"},
    {"FormatNull", "\"format\": 1", "\"format\": @null", "/format", "null", "an integer"},
    {"GravityAsNumber", "[0, 0, -9.81]", "@-9.81", "/gravity_m_s2", "-9.81", "array of three"},
    {"GravityWithTwo", "[0, 0, -9.81]", "@[0, -9.81]", "/gravity_m_s2", "an array of 2", "three"},
    {"GravityWithText", "[0, 0, -9.81]", "[0, @\"0\", -9.81]", "/gravity_m_s2/1", "\"0\"", "m/s^2"},
    {"GravityWithBoolean", "[0, 0, -9.81]", "[@false, 0, -9.81]", "/gravity_m_s2/0", "false",
     "a number"},
    {"BooleanAsNumber", "\"warm_starting\": true", "\"warm_starting\": @1", "/solver/warm_starting",
     "1", "true or false"},
    {"IterationsWithFraction", "\"iterations\": 10", "\"iterations\": @3.7", "/solver/iterations",
     "3.7", "an integer from 1 to 1000"},
    {"SolverAsArray", "{\"iterations\": 10, \"broadphase\": \"grid\", \"warm_starting\": true}",
     "@[]", "/solver", "an array of 0 values", "an object"},
    {"MaterialsAsObject", "[{\"name\": \"wood\", \"friction\": 0.5, \"restitution\": 0.25}]",
     "[{\"name\": \"wood\", \"friction\": 0.5, \"restitution\": 0.25}, @7]", "/materials/1", "7",
     "an object (material)"},
    {"ShapeAsText", "{\"type\": \"box\", \"size_m\": [1, 2, 3]}", "@\"box\"", "/bodies/0/shape",
     "\"box\"", "an object"},
    {"TypeAsNumber", "\"type\": \"box\"", "\"type\": @5", "/bodies/0/shape/type", "5", "\"box\""},
    {"NameAsNumber", "\"name\": \"floor\"", "\"name\": @1", "/statics/0/name", "1", "a string"},
    {"NameEmpty", "\"name\": \"floor\"", "\"name\": @\"\"", "/statics/0/name", "\"\"",
     "a string of 1 to 200"},
    {"PointAsNumber", "[1, 0, 0], [0, 1, 0], [0, 0, 1]]", "@1, [0, 1, 0], [0, 0, 1]]",
     "/bodies/2/shape/points_m/1", "1", "an array of three"},
    {"TriangleWithFraction", "[[0, 1, 2]]", "[[0, @1.5, 2]]", "/statics/1/shape/triangles/0/1",
     "1.5", "an integer"},
    {"CellsWithFraction", "\"cells\": [8, 8, 8]", "\"cells\": [8, @8.5, 8]", "/territory/cells/1",
     "8.5", "an integer from 1"},
    {"GeneratorAsNumber", "\"generators\": [\n", "\"generators\": [\n@17,", "/generators/0", "17",
     "an object (generator)"},

    // Ranges.
    {"TimeStepZero", "\"time_step_s\": 0.01", "\"time_step_s\": @0", "/time_step_s", "0",
     "a number from 1e-6 to 1 s"},
    {"TimeStepNegative", "\"time_step_s\": 0.01", "\"time_step_s\": @-0.01", "/time_step_s",
     "-0.01", "a number from 1e-6"},
    {"DurationNegative", "\"duration_s\": 1", "\"duration_s\": @-1", "/duration_s", "-1",
     "a number from 0"},
    {"MassNegative", "\"mass_kg\": 2", "\"mass_kg\": @-2", "/bodies/0/mass_kg", "-2",
     "a number from 1e-12 to 1e12 kg"},
    {"MassZero", "\"mass_kg\": 2", "\"mass_kg\": @0", "/bodies/0/mass_kg", "0", "kg"},
    {"MassHuge", "\"mass_kg\": 2", "\"mass_kg\": @1e13", "/bodies/0/mass_kg", "1e13", "kg"},
    {"SizeZero", "\"size_m\": [1, 2, 3]", "\"size_m\": [1, @0, 3]", "/bodies/0/shape/size_m/1", "0",
     "a number from 1e-4 to 1e5 m"},
    {"RadiusNegative", "\"radius_m\": 0.5}, \"density_kg_m3\"",
     "\"radius_m\": @-0.5}, \"density_kg_m3\"", "/bodies/1/shape/radius_m", "-0.5", "m"},
    {"PositionFarAway", "\"position_m\": [0, 0, 5]", "\"position_m\": [0, 0, @2e9]",
     "/bodies/0/position_m/2", "2e9", "a number from -1e9 to 1e9 m"},
    {"SpeedHuge", "\"velocity_m_s\": [1, 2, 3]", "\"velocity_m_s\": [@1e300, 2, 3]",
     "/bodies/1/velocity_m_s/0", "1e300", "m/s"},
    {"FrictionNegative", "\"friction\": 0.5", "\"friction\": @-0.5", "/materials/0/friction",
     "-0.5", "a number from 0"},
    {"RestitutionAboveOne", "\"restitution\": 0.25", "\"restitution\": @1.01",
     "/materials/0/restitution", "1.01", "a number from 0 to 1"},
    {"IdNegative", "\"id\": 7", "\"id\": @-7", "/bodies/0/id", "-7",
     "an integer from 0 to 2147483647"},
    {"IdBeyond31Bits", "\"id\": 7", "\"id\": @2147483648", "/bodies/0/id", "2147483648",
     "2147483647"},
    {"IdBeyond64Bits", "\"id\": 7", "\"id\": @18446744073709551615", "/bodies/0/id",
     "18446744073709551615", "2147483647"},
    {"IdBeyondAllIntegers", "\"id\": 7", "\"id\": @99999999999999999999", "/bodies/0/id",
     "99999999999999999999", "2147483647"},
    {"CountZero", "\"count\": 3", "\"count\": @0", "/generators/0/count", "0", "an integer from 1"},
    {"SeedNegative", "\"seed\": 1", "\"seed\": @-1", "/generators/1/seed", "-1", "an integer"},
    {"CellSizeZero", "\"cell_size_m\": 2", "\"cell_size_m\": @0", "/territory/cell_size_m", "0",
     "a number from"},
    {"CellsZero", "\"cells\": [8, 8, 8]", "\"cells\": [8, 8, @0]", "/territory/cells/2", "0",
     "an integer from 1"},
    {"BufferZero", "\"buffer_entries\": 16", "\"buffer_entries\": @0", "/buffer_entries", "0",
     "an integer from 1"},
    {"ThreadsZero", "\"threads\": 2", "\"threads\": @0", "/executor/threads", "0",
     "an integer from 1"},
    {"BalancingIntervalZero", "\"interval_steps\": 20", "\"interval_steps\": @0",
     "/balancing/interval_steps", "0", "an integer from 1"},
    {"TooFewPoints", "[[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]",
     "@[[0, 0, 0], [1, 0, 0], [0, 1, 0]]", "/bodies/2/shape/points_m", "an array of 3",
     "an array (4 to 4096)"},

    // Drives and moving surfaces.
    {"SurfaceVelocityAsNumber", "\"surface_velocity_m_s\": [0, 4, 0]",
     "\"surface_velocity_m_s\": @4", "/statics/1/surface_velocity_m_s", "4", "array of three"},
    {"SurfaceVelocityHuge", "\"surface_velocity_m_s\": [0, 4, 0]",
     "\"surface_velocity_m_s\": [0, @1e7, 0]", "/statics/1/surface_velocity_m_s/1", "1e7",
     "a number from -1e6 to 1e6 m/s"},
    {"UnknownDrive", "\"drive\": \"walk\"", "\"drive\": @\"wlak\"", "/bodies/2/drive", "\"wlak\"",
     "the name of a drive, such as \"lane\" or \"walk\""},
    {"DriveAsNumber", "\"drive\": \"walk\"", "\"drive\": @1", "/bodies/2/drive", "1", "a string"},
    {"UnknownDriveOfGenerator", "\"count\": 5, \"seed\": 1,",
     "\"count\": 5, \"seed\": 1, \"drive\": @\"run\",", "/generators/1/drive", "\"run\"",
     "the name of a drive"},
    {"DriveNameTwice", "\"name\": \"lane\"", "\"name\": @\"walk\"", "/drives/1/name",
     "\"walk\" again", "each drive name once"},
    {"DriveWithoutAim", "{\"name\": \"walk\", \"velocity_m_s\": [0, 3, 0],",
     "@{\"name\": \"walk\",", "/drives/0",
     "neither velocity_m_s nor way_points_m and speed_m_s and half_width_m", "either"},
    {"DriveWithTwoAims", "{\"name\": \"lane\",",
     "@{\"velocity_m_s\": [1, 0, 0], \"name\": \"lane\",", "/drives/1",
     "velocity_m_s and way_points_m", "either"},
    {"LaneWithoutSpeed",
     "{\"name\": \"lane\", \"way_points_m\": [[0, 0, 0], [8, 0, 0], [8, 8, 0]], \"speed_m_s\": "
     "1.5,",
     "@{\"name\": \"lane\", \"way_points_m\": [[0, 0, 0], [8, 0, 0], [8, 8, 0]],", "/drives/1",
     "way_points_m and half_width_m", "either"},
    {"OneWayPoint", "[[0, 0, 0], [8, 0, 0], [8, 8, 0]]", "@[[0, 0, 0]]", "/drives/1/way_points_m",
     "an array of 1", "an array (2 to 1000)"},
    {"WayPointFarAway", "[8, 8, 0]]", "[8, @2e9, 0]]", "/drives/1/way_points_m/2/1", "2e9",
     "a number from -1e9 to 1e9 m"},
    {"WayPointsOverEachOther", "[8, 8, 0]]", "@[8, 0, 5]]", "/drives/1/way_points_m/2",
     "a way point 0 m from the one before", "at least 1e-4 m"},
    {"LaneSpeedNegative", "\"speed_m_s\": 1.5", "\"speed_m_s\": @-1.5", "/drives/1/speed_m_s",
     "-1.5", "a number from 0 to 1e6 m/s"},
    {"LaneWidthZero", "\"half_width_m\": 1.25", "\"half_width_m\": @0", "/drives/1/half_width_m",
     "0", "a number from 1e-4 to 1e5 m"},
    {"TimeConstantZero", "\"time_constant_s\": 0.5", "\"time_constant_s\": @0",
     "/drives/0/time_constant_s", "0", "a number from 0.001 to 1e6 s"},
    {"NoTimeConstant",
     "{\"name\": \"walk\", \"velocity_m_s\": [0, 3, 0], \"time_constant_s\": 0.5,",
     "@{\"name\": \"walk\", \"velocity_m_s\": [0, 3, 0],", "/drives/0",
     "no key \"time_constant_s\"", "a number from 0.001"},
    {"PushNegative", "\"max_acceleration_m_s2\": 5", "\"max_acceleration_m_s2\": @-5",
     "/drives/0/max_acceleration_m_s2", "-5", "a number from 0 to 1e6 m/s^2"},

    // Keys and names.
    {"UnknownKeyOnTop", "\"format\": 1", "\"format\": 1, @\"grvity\": 1", "/grvity",
     "the unknown key \"grvity\"", "\"gravity_m_s2\""},
    {"UnknownKeyInBody", "\"id\": 7", "\"id\": 7, @\"mass\": 2", "/bodies/0/mass", "unknown key",
     "\"mass_kg\""},
    {"UnknownKeyInShape", "\"size_m\": [1, 2, 3]", "\"size_m\": [1, 2, 3], @\"radius_m\": 1",
     "/bodies/0/shape/radius_m", "unknown key", "\"size_m\" or \"type\""},
    {"KeyEscaped", "\"id\": 7", "\"id\": 7, @\"a/b~c\": 2", "/bodies/0/a~1b~0c", "a/b~c", "keys"},
    {"KeyTwice", "\"id\": 7", "\"id\": 7, @\"id\": 8", "/bodies/0/id", "the key \"id\" again",
     "once"},
    {"KeyTwiceEscaped", "\"id\": 7", "\"id\": 7, @\"\\u0069d\": 8", "/bodies/0/id",
     "the key \"id\" again", "once"},
    {"UnknownShape", "\"type\": \"box\"", "\"type\": @\"cube\"", "/bodies/0/shape/type", "\"cube\"",
     "\"sphere\", \"box\""},
    {"UnknownBroadphase", "\"grid\"", "@\"gird\"", "/solver/broadphase", "\"gird\"",
     "\"grid\" or \"all-pairs\""},
    {"UnknownExecutor", "\"kind\": \"threads\"", "\"kind\": @\"mpi\"", "/executor/kind", "\"mpi\"",
     "\"sequential\" or \"threads\""},
    {"UnknownGenerator", "\"type\": \"gas\"", "\"type\": @\"liquid\"", "/generators/1/type",
     "\"liquid\"", "\"gas\""},
    {"MeshAsBody", "{\"type\": \"box\", \"size_m\": [1, 2, 3]}",
     "{\"type\": @\"mesh\", \"file\": \"a.obj\"}", "/bodies/0/shape/type", "\"mesh\"", "\"hull\""},

    // Missing keys: the object that lacks them.
    {"NoFormat", "{\n  \"format\": 1,", "@{", "", "no key \"format\"", "an integer 1"},
    {"NoGravity", "{\n  \"format\": 1,\n  \"gravity_m_s2\": [0, 0, -9.81],", "@{\"format\": 1,", "",
     "no key \"gravity_m_s2\"", "three numbers"},
    {"NoDuration",
     "{\n  \"format\": 1,\n  \"gravity_m_s2\": [0, 0, -9.81],\n  \"time_step_s\": "
     "0.01,\n  \"duration_s\": 1,",
     "@{\"format\": 1, \"gravity_m_s2\": [0, 0, 0], \"time_step_s\": 1,", "",
     "neither duration_s nor steps", "either duration_s or steps"},
    {"NoMass", "{\"id\": 7, \"shape\": {\"type\": \"box\", \"size_m\": [1, 2, 3]}, \"mass_kg\": 2,",
     "@{\"id\": 7, \"shape\": {\"type\": \"box\", \"size_m\": [1, 2, 3]},", "/bodies/0",
     "neither mass_kg nor density_kg_m3", "either"},
    {"MassAndDensity", "{\"id\": 7,", "@{\"density_kg_m3\": 1, \"id\": 7,", "/bodies/0",
     "mass_kg and density_kg_m3", "either mass_kg or density_kg_m3"},
    {"NoType", "{\"type\": \"box\",", "@{", "/bodies/0/shape", "no key \"type\"", "\"box\""},
    {"NoSeed",
     "{\"type\": \"gas\", \"first_id\": 20, \"shape\": {\"type\": \"sphere\", "
     "\"radius_m\": 0.5},\n     \"mass_kg\": 1, \"material\": \"wood\", \"count\": 5, \"seed\": 1,",
     "@{\"type\": \"gas\", \"first_id\": 20, \"shape\": {\"type\": \"sphere\", \"radius_m\": 0.5}, "
     "\"mass_kg\": 1, \"material\": \"wood\", \"count\": 5,",
     "/generators/1", "no key \"seed\"", "an integer"},
    {"MeshWithoutTriangles",
     "{\"type\": \"mesh\", \"vertices_m\": [[0, 0, 0], [1, 0, 0], [0, 1, "
     "0]],\n               \"triangles\": [[0, 1, 2]]}",
     "@{\"type\": \"mesh\", \"vertices_m\": [[0, 0, 0], [1, 0, 0], [0, 1, 0]]}", "/statics/1/shape",
     "vertices_m", "either file or vertices_m and triangles"},
    {"QuaternionWithoutW", "{\"w\": 1, \"x\"", "@{\"x\"", "/bodies/1/orientation", "no key \"w\"",
     "a number"},
    {"OrientationEmpty", "{\"axis\": [0, 0, 2], \"angle_deg\": 90}", "@{\"axis\": [0, 0, 2]}",
     "/bodies/2/orientation", "no key \"angle_deg\"", "degrees"},

    // What only several places together show.
    {"DurationNoWholeSteps", "\"duration_s\": 1", "\"duration_s\": @1.005", "/duration_s",
     "1.005 = 100.4", "a whole number of steps of 0.01 s"},
    {"DurationAndSteps", "{\n  \"format\": 1,", "@{\n\"format\": 1, \"steps\": 100,", "",
     "duration_s and steps", "either"},
    {"TooManySteps", "\"time_step_s\": 0.01,\n  \"duration_s\": 1",
     "\"time_step_s\": 1e-6, \"duration_s\": @1e4", "/duration_s", "steps", "at most 1000000000"},
    {"UnknownMaterial", "\"mass_kg\": 2,\n     \"material\": \"wood\"",
     "\"mass_kg\": 2,\n\"material\": @\"wod\"", "/bodies/0/material", "\"wod\"", "\"wood\""},
    {"UnknownMaterialOfStatic", "[0, 0, 3]}, \"material\": \"wood\"",
     "[0, 0, 3]}, \"material\": @\"iron\"", "/statics/0/material", "\"iron\"", "\"wood\""},
    {"MaterialTwice", "\"restitution\": 0.25}",
     "\"restitution\": 0.25}, {\"name\": @\"wood\", \"friction\": 0, \"restitution\": 0}",
     "/materials/1/name", "\"wood\" again", "once"},
    {"StaticNameTwice", "\"name\": \"ramp\"", "\"name\": @\"floor\"", "/statics/1/name",
     "\"floor\" again", "once"},
    {"BodyIdTwice", "\"id\": 3", "\"id\": @7", "/bodies/2/id", "id 7", "no other body"},
    {"IdInsideGenerated", "\"first_id\": 10", "\"first_id\": @5", "/generators/0/first_id",
     "ids 5 to 7", "no other body"},
    {"GeneratorsOverlap", "\"first_id\": 20", "\"first_id\": @12", "/generators/1/first_id",
     "ids 12 to 16", "no other body"},
    {"IdsRunOut", "\"first_id\": 20", "\"first_id\": @2147483644", "/generators/1/first_id",
     "2147483648", "ids up to 2147483647"},
    {"TooManyBodies", "\"count\": 3", "\"count\": @1000000", "/generators/0/count",
     "1000000 bodies after 3", "at most 1000000"},
    {"MoreWorldsThanCells", "\"worlds\": 2", "\"worlds\": @513", "/territory/worlds",
     "513 worlds for 512 cells", "at most one"},
    {"TooManyCells", "\"cells\": [8, 8, 8]", "\"cells\": @[1000, 1000, 1000]", "/territory/cells",
     "more cells", "10000000"},
    {"TooManyCellsInOneLayer", "\"cells\": [8, 8, 8]", "\"cells\": @[10000000, 10000000, 10000000]",
     "/territory/cells", "more cells", "10000000"},
    {"DensityMakesNoMass", "{\"type\": \"sphere\", \"radius_m\": 0.5}, \"density_kg_m3\": 500",
     "{\"type\": \"sphere\", \"radius_m\": 1e-4}, \"density_kg_m3\": @1e-6",
     "/bodies/1/density_kg_m3", "a mass of 4.18", "1e-12"},
    {"QuaternionNotUnit", "{\"w\": 1, \"x\": 0", "@{\"w\": 0.5, \"x\": 0", "/bodies/1/orientation",
     "norm 0.5", "unit"},
    {"AxisZero", "\"axis\": [0, 0, 2]", "\"axis\": @[0, 0, 0]", "/bodies/2/orientation/axis",
     "length 0", "at least"},
    {"NormalZero", "\"normal\": [0, 0, 3]", "\"normal\": @[0, 0, 0]", "/statics/0/shape/normal",
     "length 0", "at least"},
    {"HullFlat", "[[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]",
     "@[[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]", "/bodies/2/shape/points_m", "without a hull",
     "not in one plane"},
    {"HullOfOnePoint", "[[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]",
     "@[[1, 1, 1], [1, 1, 1], [1, 1, 1], [1, 1, 1]]", "/bodies/2/shape/points_m", "without a hull",
     "not in one plane"},
    {"HullTooSmall", "[[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]",
     "@[[0, 0, 0], [1e-5, 0, 0], [0, 1e-5, 0], [0, 0, 1e-5]]", "/bodies/2/shape/points_m",
     "a hull of size", "0.0001"},
    {"TriangleBeyondVertices", "[[0, 1, 2]]", "[@[0, 1, 3]]", "/statics/1/shape/triangles/0",
     "beyond the vertices", "0 to 2"},
    {"TriangleWithoutArea", "[[0, 1, 2]]", "[@[0, 1, 1]]", "/statics/1/shape/triangles/0",
     "without area", "not in one line"},
    {"RegionInsideOut", "\"region_min_m\": [20, 0, 1]", "\"region_min_m\": @[20, 0, 10]",
     "/generators/1/region_min_m", "beyond region_max_m", "not above"},
    {"RegionTooFull", "\"count\": 5", "\"count\": @5000", "/generators/1/count", "full after",
     "without overlap"},
    {"GeneratedTooFarAway", "\"count\": 3, \"position_m\": [9, 0, 1]}",
     "\"count\": 3, \"position_m\": [9, 0, 1]}, @{\"type\": \"chain\", \"first_id\": 100, "
     "\"shape\": {\"type\": \"sphere\", \"radius_m\": 1}, \"mass_kg\": 1, \"material\": \"wood\", "
     "\"count\": 2, \"axis\": \"y\", \"position_m\": [0, 1e9, 0]}",
     "/generators/1", "body 101", "within 1e9 m"},
};

INSTANTIATE_TEST_SUITE_P(Reader, LocatedFault, testing::ValuesIn(kBreakages),
                         [](const auto& broken) { return std::string(broken.param.name); });

TEST(Reader, ReadsTheScenarioThatTheOthersBreak) { EXPECT_TRUE(faults_of(kSmallScenario).empty()); }

TEST(Reader, ListsAllFaultsOfAFileInTheOrderOfTheirPlaces) {
  std::string text = replaced(kSmallScenario, "\"worlds\": 2", "\"worlds\": 2000");
  text = replaced(text, "\"mass_kg\": 2", "\"mass_kg\": -2");
  text = replaced(text, "\"format\": 1", "\"format\": 1, \"colour\": 1");
  text = replaced(text, "\"id\": 3", "\"id\": 7");
  text = replaced(text, "\"first_id\": 20", "\"first_id\": 11");
  std::vector<std::string> pointers;
  for (const InputFault& fault : faults_of(text)) pointers.push_back(fault.pointer);
  const std::vector<std::string> expected = {"/colour", "/bodies/0/mass_kg", "/bodies/2/id",
                                             "/generators/1/first_id", "/territory/worlds"};
  EXPECT_EQ(pointers, expected);
}

TEST(Reader, SaysWhereTheFirstOfTwoEqualIdsStands) {
  const auto faults = faults_of(replaced(kSmallScenario, "\"id\": 3", "\"id\": 7"));
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0].hint, "id 7 at 9:12 (/bodies/0/id)");
}

TEST(Reader, SuggestsTheNearestNameOrTheNameWithItsUnit) {
  const auto hint = [](std::string_view from, std::string_view to) {
    const auto faults = faults_of(replaced(kSmallScenario, from, to));
    return faults.empty() ? "no fault" : faults.front().hint;
  };
  EXPECT_EQ(hint("\"id\": 7", "\"id\": 7, \"velocity\": 1"), "did you mean \"velocity_m_s\"?");
  EXPECT_EQ(hint("\"id\": 7", "\"id\": 7, \"orientaton\": 1"), "did you mean \"orientation\"?");
  EXPECT_EQ(hint("\"format\": 1", "\"format\": 1, \"timestep_s\": 1"),
            "did you mean \"time_step_s\"?");
  EXPECT_EQ(hint("\"grid\"", "\"gird\""), "did you mean \"grid\"?");
  EXPECT_EQ(hint("\"id\": 7", "\"id\": 7, \"quux\": 1"), "");
  EXPECT_EQ(hint("{\"type\": \"box\", \"size_m\": [1, 2, 3]}", "{\"type\": \"halfspace\"}"),
            "only statics may have this shape");
}

TEST(Reader, WritesAFaultALineInTheDocumentedFormat) {
  std::string text = replaced(kSmallScenario, "\"mass_kg\": 2", "\"mass_kg\": -2");
  text = replaced(text, "\"grid\"", "\"gird\"");
  try {
    read_scenario_text(text, "folder/a.json");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(),
                 "folder/a.json:6:46: /solver/broadphase: found the string \"gird\"; allowed: one "
                 "of \"grid\" or \"all-pairs\" (did you mean \"grid\"?)\n"
                 "folder/a.json:9:73: /bodies/0/mass_kg: found -2; allowed: a number from 1e-12 to "
                 "1e12 kg");
  }
}

TEST(Reader, ListsAHundredFaultsAndCountsTheRest) {
  std::string ids;
  for (int i = 0; i < 250; ++i) ids += "{\"id\": -1},";
  try {
    read_scenario_text(replaced(kSmallScenario, "{\"id\": 7,", ids + "{\"id\": 7,"), "a.json");
    FAIL();
  } catch (const InputError& error) {
    const std::string message = error.what();
    EXPECT_EQ(std::count(message.begin(), message.end(), '\n'), 100);
    EXPECT_TRUE(message.ends_with("a.json: and at least 900 more")) << message.substr(9000);
    EXPECT_EQ(error.faults().size(), kMaxFaults);
  }
}

TEST(Reader, CountsColumnsInCharactersNotBytes) {
  const auto faults = faults_of("{\"\xC3\xA4\xE2\x82\xAC\": 1, \"format\": \"x\"}");
  const auto at_format = std::find_if(faults.begin(), faults.end(), [](const InputFault& fault) {
    return fault.pointer == "/format";
  });
  ASSERT_NE(at_format, faults.end());
  EXPECT_EQ(at_format->line, 1u);
  EXPECT_EQ(at_format->column, 21u);
}

}  // namespace
}  // namespace soda::scenarios
