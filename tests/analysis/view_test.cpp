// What `soda view` shows: shapes as triangles, and the page, read as its script reads it.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <set>
#include <string>
#include <utility>

#include "analysis/child_process.hpp"
#include "analysis/event_log/log_reader.hpp"
#include "analysis/text/byte_codec.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/viewer/recording.hpp"
#include "analysis/viewer/triangles.hpp"
#include "physics/shapes/mass_properties.hpp"

namespace soda::analysis {
namespace {

using analysis_test::contains;
using analysis_test::library_file;
using analysis_test::read_file;
using analysis_test::run_soda;
using analysis_test::TemporaryFolder;
using physics::Vec3;

constexpr double kPi = std::numbers::pi;

Vec3 vector_at(const Triangles& floats, std::size_t at) {
  return {floats[at], floats[at + 1], floats[at + 2]};
}

// By the divergence theorem: right only if the surface is closed and its corners run
// counter-clockwise seen from outside.
double enclosed_volume_m3(const Triangles& floats) {
  double volume = 0.0;
  for (std::size_t at = 0; at < floats.size(); at += 18)
    volume += vector_at(floats, at)
                  .dot(vector_at(floats, at + 6).cross(vector_at(floats, at + 12)) / 6.0);
  return volume;
}

double least_cosine_of_normals(const Triangles& floats) {
  double least = 1.0;
  for (std::size_t at = 0; at < floats.size(); at += 18) {
    const Vec3 a = vector_at(floats, at), b = vector_at(floats, at + 6);
    const Vec3 face = (b - a).cross(vector_at(floats, at + 12) - a).normalized();
    for (std::size_t corner = at; corner < at + 18; corner += 6)
      least = std::min(least, face.dot(vector_at(floats, corner + 3)));
  }
  return least;
}

Triangles drawn(const physics::Shape& shape) { return triangles_of(shape, {}, Vec3::Zero(), 1.0); }

// A regular polygon of 24 sides has this share of its circle's area.
const double kPolygon = 24.0 * std::sin(2.0 * kPi / 24.0) / (2.0 * kPi);

TEST(ShapesAsTriangles, OfFlatFacesEncloseTheirVolume) {
  EXPECT_NEAR(enclosed_volume_m3(drawn(physics::Box{{0.5, 1.0, 2.0}})), 8.0, 1e-5);
  const std::vector<Vec3> corners = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0},
                                     {0, 0, 1}, {1, 0, 1}, {0, 1, 1}};
  const auto wedge = std::get<physics::ConvexHull>(physics::make_convex_hull(corners));
  EXPECT_NEAR(enclosed_volume_m3(drawn(wedge)), 0.5, 1e-6);
}

TEST(ShapesAsTriangles, OfRoundSurfacesAreClosedAndInscribed) {
  EXPECT_NEAR(enclosed_volume_m3(drawn(physics::Cylinder{0.5, 3.0})), kPolygon * kPi * 0.75, 1e-5);
  const double ball = 4.0 / 3.0 * kPi, drawn_ball = enclosed_volume_m3(drawn(physics::Sphere{1.0}));
  EXPECT_LT(drawn_ball, ball);
  EXPECT_GT(drawn_ball, 0.96 * ball);
  const double capsule = enclosed_volume_m3(drawn(physics::Capsule{1.0, 3.0}));
  EXPECT_NEAR(capsule - drawn_ball, kPolygon * kPi * 3.0, 1e-4);
}

TEST(ShapesAsTriangles, HaveNormalsThatPointOutwards) {
  for (const physics::Shape& shape :
       {physics::Shape(physics::Sphere{2.0}), physics::Shape(physics::Box{}),
        physics::Shape(physics::Capsule{}), physics::Shape(physics::Cylinder{})})
    EXPECT_GT(least_cosine_of_normals(drawn(shape)), 0.97);  // 13 degrees
}

TEST(ShapesAsTriangles, OfACompoundAreThoseOfItsParts) {
  const std::vector<physics::Shape> shapes{physics::Box{{0.5, 1.0, 2.0}}, physics::Sphere{1.0}};
  const double turn = std::sqrt(0.5);
  const physics::Compound both{{{0, Vec3(3, 0, 0), physics::Quat(turn, turn, 0, 0)},
                                {1, Vec3(-3, 0, 0), physics::Quat::Identity()}}};
  const Triangles together = triangles_of(both, shapes, Vec3::Zero(), 1.0);
  EXPECT_NEAR(enclosed_volume_m3(together), 8.0 + enclosed_volume_m3(drawn(shapes[1])), 1e-4);
  double farthest = 0.0;
  for (std::size_t at = 0; at < together.size(); at += 6)
    farthest = std::max(farthest, std::abs(vector_at(together, at).y()));
  EXPECT_NEAR(farthest, 2.0, 1e-5);  // the box's z lies along y
  EXPECT_GT(least_cosine_of_normals(together), 0.97);
}

TEST(ShapesAsTriangles, OfAHalfSpaceAreASquareOnItAroundTheMiddle) {
  const Vec3 normal = Vec3(1, 2, 2) / 3.0;
  const Triangles square = triangles_of(physics::HalfSpace{normal, 0.5}, {}, Vec3(7, 8, 9), 4.0);
  ASSERT_EQ(square.size(), 2u * 18u);
  Vec3 middle = Vec3::Zero();
  for (std::size_t at = 0; at < square.size(); at += 6) {
    EXPECT_NEAR(normal.dot(vector_at(square, at)), 0.5, 1e-5);
    EXPECT_NEAR((vector_at(square, at) - Vec3(7, 8, 9)).cross(normal).norm(), 4 * std::sqrt(2.0),
                1e-5);
    middle += vector_at(square, at) / 6.0;
  }
  EXPECT_GT(least_cosine_of_normals(square), 0.999);
}

ByteBuffer from_base64(const std::string& text) {
  static const std::string kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  ByteBuffer bytes;
  std::uint32_t bits = 0;
  int held = 0;
  for (const char letter : text.substr(0, text.find('='))) {
    bits = bits << 6 | static_cast<std::uint32_t>(kDigits.find(letter));
    held += 6;
    if (held < 8) continue;
    held -= 8;
    bytes.push_back(static_cast<unsigned char>(bits >> held));
  }
  return bytes;
}

struct Pose {
  Vec3 position_m;
  physics::Quat orientation;
  double speed_m_s = 0.0;
};

// Field by field as viewer/data.js takes them.
struct Shown {
  std::string name;
  double dt_s = 0.0;
  Vec3 up;
  std::uint32_t worlds = 0;
  std::vector<std::uint32_t> labels, shape_of;
  std::vector<std::int64_t> steps;
  std::vector<std::vector<float>> shapes;
  models::Grid grid;
  std::vector<std::uint16_t> cell_owners;
  std::vector<Recording::CellChange> changes;
  std::vector<std::uint16_t> owners;
  Vec3 low_m, size_m;
  std::vector<Pose> poses;  // by frame, then body
};

std::vector<float> take_floats(ByteReader& in) {
  std::vector<float> floats(in.take_count(4));
  for (float& value : floats) value = std::bit_cast<float>(in.take<std::uint32_t>());
  return floats;
}

// As viewer/bodies.js unpacks them.
Pose take_pose(ByteReader& in, const Shown& shown) {
  Pose pose;
  for (int k = 0; k < 3; ++k) {
    const double low = in.take<std::uint16_t>(), bits = low + 65536.0 * in.take<std::uint8_t>();
    pose.position_m[k] = shown.low_m[k] + shown.size_m[k] * bits / 0xffffff;
  }
  auto packed = in.take<std::uint32_t>();
  const std::uint32_t largest = packed >> 30;
  double parts[4], sum = 0.0;
  for (std::uint32_t part = 4; part-- > 0;) {
    if (part == largest) continue;
    parts[part] = ((packed & 1023) / 1023.0 - 0.5) * std::sqrt(2.0);
    sum += parts[part] * parts[part];
    packed >>= 10;
  }
  parts[largest] = std::sqrt(std::max(0.0, 1.0 - sum));
  pose.orientation = physics::Quat(parts[0], parts[1], parts[2], parts[3]);
  pose.speed_m_s = std::bit_cast<float>(std::uint32_t{in.take<std::uint16_t>()} << 16);
  return pose;
}

ByteBuffer bytes_in(const std::string& page, const std::string& id) {
  const std::string begin = "<script id=\"" + id + "\" type=\"text/plain\">";
  EXPECT_TRUE(contains(page, begin));
  const std::size_t from = page.find(begin) + begin.size();
  return from_base64(page.substr(from, page.find('<', from) - from));
}

Shown read_page(const std::string& page) {
  const ByteBuffer bytes = bytes_in(page, "recording");
  ByteReader in(bytes);
  Shown shown;
  shown.name = in.take_string();
  shown.dt_s = in.take_double();
  for (int i = 0; i < 3; ++i) shown.up[i] = in.take_double();
  shown.worlds = in.take<std::uint32_t>();
  for (std::size_t left = in.take_count(8); left > 0; --left) {
    shown.labels.push_back(in.take<std::uint32_t>());
    shown.shape_of.push_back(in.take<std::uint32_t>());
  }
  for (std::size_t left = in.take_count(20); left > 0; --left) {
    in.take_string();
    in.take<std::uint32_t>();
    EXPECT_EQ(take_floats(in).size(), 7u);
  }
  for (std::size_t left = in.take_count(8); left > 0; --left)
    shown.steps.push_back(in.take<std::int64_t>());
  for (std::size_t left = in.take_count(8); left > 0; --left)
    shown.shapes.push_back(take_floats(in));
  for (int i = 0; i < 3; ++i) shown.grid.origin_m[i] = in.take_double();
  shown.grid.cell_size_m = in.take_double();
  for (std::int32_t& cells : shown.grid.cells) cells = in.take<std::int32_t>();
  for (std::size_t left = in.take_count(2); left > 0; --left)
    shown.cell_owners.push_back(in.take<std::uint16_t>());
  for (std::size_t left = in.take_count(12); left > 0; --left) {
    Recording::CellChange& change = shown.changes.emplace_back();
    change.frame = in.take<std::uint32_t>();
    change.cell = in.take<std::uint32_t>();
    change.from = in.take<std::uint16_t>();
    change.to = in.take<std::uint16_t>();
  }
  for (std::size_t left = in.take_count(2); left > 0; --left)
    shown.owners.push_back(in.take<std::uint16_t>());
  for (int i = 0; i < 3; ++i) shown.low_m[i] = in.take_double();
  for (int i = 0; i < 3; ++i) shown.size_m[i] = in.take_double();
  while (in.left() > 0) shown.poses.push_back(take_pose(in, shown));
  return shown;
}

class View : public testing::Test {
 protected:
  void log(const std::string& scene, const std::string& steps) {
    ASSERT_EQ(
        run_soda({"run", library_file(scene), "--steps", steps, "--log", log_file_}).exit_code,
        kExitOk);
  }
  const TemporaryFolder folder_;
  const std::string log_file_ = folder_.file("run.sodalog"), page_file_ = folder_.file("run.html");
};

TEST_F(View, ShowsTheLoggedStatesAndTheLastStep) {
  log("border-stack", "7");
  const auto viewed = run_soda({"view", log_file_, "--every", "3", "-o", page_file_});
  EXPECT_EQ(viewed.exit_code, kExitOk) << viewed.err;
  const Shown shown = read_page(read_file(page_file_));
  EXPECT_EQ(shown.name, "border-stack");
  EXPECT_EQ(shown.steps, (std::vector<std::int64_t>{0, 3, 6, 7}));
  EXPECT_LT((shown.up - Vec3::UnitZ()).norm(), 1e-15);
  LogReader log(log_file_);
  ASSERT_EQ(shown.labels, log.labels());
  ASSERT_EQ(shown.poses.size(), 4 * shown.labels.size());
  auto pose = shown.poses.begin();
  for (const std::int64_t step : shown.steps)
    for (const physics::BodyState& state : log.read_step(step).states) {
      EXPECT_LT((pose->position_m - state.position_m).norm(), 1e-6 * shown.size_m.norm()) << step;
      EXPECT_LT(pose->orientation.angularDistance(state.orientation), 0.005) << step;
      const double speed = state.linear_velocity_m_s.norm();
      EXPECT_NEAR(pose->speed_m_s, speed, 0.01 * speed) << step;
      ++pose;
    }
  std::set<int> owners;
  for (const std::uint16_t owner : shown.owners) owners.insert(owner & ~Recording::kResting);
  EXPECT_GT(owners.size(), 1u);
  EXPECT_LT(*owners.rbegin(), static_cast<int>(shown.worlds));
  EXPECT_TRUE(shown.changes.empty());
}

// Whatever balancing does: a body has the colour of who owns its cell in that frame.
TEST_F(View, ShowsTerritoriesAsTheyChange) {
  const auto ran = run_soda({"run", library_file("eight-corner"), "--steps", "60", "--buffer", "4",
                             "--executor", "virtual", "--balancing", "random",
                             "--balancing-interval", "2", "--log", log_file_});
  ASSERT_EQ(ran.exit_code, kExitOk) << ran.err;
  ASSERT_EQ(run_soda({"view", log_file_, "--every", "7", "-o", page_file_}).exit_code, kExitOk);
  const Shown shown = read_page(read_file(page_file_));
  LogReader log(log_file_);
  std::vector<std::uint16_t> owners = shown.cell_owners;
  ASSERT_EQ(owners.size(), shown.grid.cell_count());
  EXPECT_EQ(std::ranges::max(owners), shown.worlds - 1);
  auto change = shown.changes.begin();
  for (std::size_t frame = 0; frame < shown.steps.size(); ++frame) {
    for (; change != shown.changes.end() && change->frame == frame; ++change)
      ASSERT_EQ(std::exchange(owners.at(change->cell), change->to), change->from);
    const LoggedStep logged = log.read_step(shown.steps[frame]);
    for (std::size_t body = 0; body < logged.states.size(); ++body) {
      const auto cell = shown.grid.cell_of(logged.states[body].position_m);
      ASSERT_EQ(shown.owners[frame * logged.states.size() + body] & ~Recording::kResting,
                owners[shown.grid.index_of_cell(cell)]);
    }
  }
  EXPECT_EQ(change, shown.changes.end());
  EXPECT_GT(shown.changes.size(), 20u);
  EXPECT_NE(owners, shown.cell_owners);
}

TEST_F(View, LeavesOutBodiesWhileTheyAreAway) {
  log("user-input", "60");
  ASSERT_EQ(run_soda({"view", log_file_, "-o", page_file_}).exit_code, kExitOk);
  const Shown shown = read_page(read_file(page_file_));
  LogReader log(log_file_);
  std::size_t away = 0;
  for (std::size_t frame = 0; frame < shown.steps.size(); ++frame) {
    const LoggedStep step = log.read_step(shown.steps[frame]);
    for (std::size_t body = 0; body < shown.labels.size(); ++body) {
      const bool there = std::ranges::binary_search(step.ids, static_cast<physics::BodyId>(body));
      EXPECT_EQ(shown.owners[frame * shown.labels.size() + body] != 0xffff, there);
      away += !there;
    }
  }
  EXPECT_GT(away, 0u);
}

TEST_F(View, TakesNothingFromOutsideAndKeepsLongRunsSmall) {
  log("twelve-worlds", "1300");
  ASSERT_EQ(run_soda({"view", log_file_, "-o", page_file_}).exit_code, kExitOk);
  const std::string page = read_file(page_file_);
  EXPECT_FALSE(contains(page, "http"));
  EXPECT_FALSE(contains(page, "src="));
  EXPECT_FALSE(contains(page, "{{"));
  EXPECT_LT(page.size(), 23e6);
  const Shown shown = read_page(page);
  EXPECT_EQ(shown.steps[1], 2);  // 500 bodies x 1300 steps are too many
  EXPECT_EQ(shown.steps.back(), 1300);
}

TEST_F(View, RefusesWhatItCannotReadOrWrite) {
  EXPECT_EQ(run_soda({"view", folder_.file("none.sodalog")}).exit_code, kExitFile);
  log("border-stack", "2");
  EXPECT_EQ(run_soda({"view", log_file_, "-o", folder_.file("none/run.html")}).exit_code,
            kExitFile);
  EXPECT_EQ(run_soda({"view", log_file_, "--every", "0"}).exit_code, kExitInput);
}

TEST(ViewPage, ARunMakesThePageThatItsLogWouldAndLeavesNothingElse) {
  const TemporaryFolder folder;
  const std::string page = folder.file("page.html"), log = folder.file("run.sodalog");
  const std::string scene = library_file("crowd");
  const std::string executor = "--executor=virtual";  // whose clock is the same each time
  const auto ran = run_soda({"run", scene, "--steps", "30", executor, "--view", page});
  EXPECT_EQ(ran.exit_code, kExitOk) << ran.err;
  EXPECT_TRUE(contains(ran.out, "page.html: 400 bodies, 12 worlds, 31 frames")) << ran.out;
  EXPECT_EQ(folder.files(), (std::vector<std::string>{"page.html"}));
  EXPECT_EQ(
      run_soda({"run", scene, "--steps", "30", executor, "--log", log, "--log-level", "trace"})
          .exit_code,
      kExitOk);
  EXPECT_EQ(run_soda({"view", log}).exit_code, kExitOk);
  EXPECT_TRUE(read_file(page) == read_file(log + ".html"));
  EXPECT_EQ(run_soda({"run", scene, "--steps", "30", "--view", page}).exit_code, kExitFile);
  EXPECT_EQ(run_soda({"run", scene, "--view", scene, "--force"}).exit_code, kExitInput);
  EXPECT_EQ(run_soda({"run", scene, "--view", folder.file("other.html"), "--log", log, "--force",
                      "--log-level", "inputs"})
                .exit_code,
            kExitInput);
}

}  // namespace
}  // namespace soda::analysis
