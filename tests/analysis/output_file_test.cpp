// What the program reads and writes: never over another file unasked, whole or under another name,
// and nothing that blocks or has no end.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <thread>

#include "analysis/child_process.hpp"
#include "analysis/text/exit_codes.hpp"

namespace soda::analysis {
namespace {

namespace fs = std::filesystem;
using analysis_test::ChildResult;
using analysis_test::contains;
using analysis_test::library_file;
using analysis_test::Meanwhile;
using analysis_test::read_file;
using analysis_test::run_soda;
using analysis_test::TemporaryFolder;
using analysis_test::write_file;

const Meanwhile kNotForEver{[] { alarm(60); }, [](int) {}};

std::string scene_with(const std::string& more) {
  return R"({"format": 1, "gravity_m_s2": [0, 0, -10], "time_step_s": 0.01, "steps": 10, )" + more +
         R"("materials": [{"name": "m", "friction": 0.5, "restitution": 0}], )"
         R"("bodies": [{"id": 1, "shape": {"type": "sphere", "radius_m": 1}, "density_kg_m3": 1, )"
         R"("material": "m", "position_m": [0, 0, 0]}]})";
}

std::size_t files_in(const std::string& folder) {
  return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), {}));
}

// Waits until the folder has a file whose name ends so, of at least so many bytes.
std::string await_file(const std::string& folder, const std::string& ending, std::size_t bytes) {
  for (int looks = 0; looks < 3000; ++looks) {
    for (const auto& entry : fs::directory_iterator(folder)) {
      std::error_code gone;
      if (entry.path().string().ends_with(ending) && fs::file_size(entry.path(), gone) >= bytes)
        return entry.path();
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return "";
}

class OutputFiles : public testing::Test {
 protected:
  ChildResult run(const std::string& log, std::vector<std::string> more = {}) {
    std::vector<std::string> command = {"run", scene_, "--steps", "3", "--log", log};
    command.insert(command.end(), more.begin(), more.end());
    return run_soda(command, kNotForEver);
  }
  std::string path() const { return fs::path(scene_).parent_path(); }

  const TemporaryFolder folder_;
  const std::string scene_ = [this] {
    fs::copy_file(library_file("border-stack"), folder_.file("scene.json"));
    return folder_.file("scene.json");
  }();
  const std::string log_ = folder_.file("run.sodalog");
};

TEST_F(OutputFiles, AreNotWrittenOverAnythingUnlessForced) {
  write_file(log_, "mine");
  const ChildResult refused = run(log_);
  EXPECT_EQ(refused.exit_code, kExitFile);
  EXPECT_TRUE(contains(refused.err, "--force")) << refused.err;
  EXPECT_EQ(refused.out, "");
  EXPECT_EQ(read_file(log_), "mine");
  EXPECT_EQ(files_in(path()), 2u);
  EXPECT_EQ(run(log_, {"--force"}).exit_code, kExitOk);
  EXPECT_EQ(run_soda({"replay", log_}).exit_code, kExitOk);
  EXPECT_EQ(files_in(path()), 2u);
  const std::string page = folder_.file("page.html");
  write_file(page, "mine");
  EXPECT_EQ(run_soda({"view", log_, "-o", page}).exit_code, kExitFile);
  EXPECT_EQ(read_file(page), "mine");
  EXPECT_EQ(run_soda({"view", log_, "-o", page, "--force"}).exit_code, kExitOk);
  EXPECT_TRUE(contains(read_file(page), "<html"));
  const std::string report = folder_.file("report.html");
  write_file(report, "mine");
  const std::vector<std::string> accuracy = {
      "accuracy", "--cases", SODA_SOURCE_DIR "/scenarios/cases", "free-fall", "--repeat", "0",
      "-o",       report};
  EXPECT_EQ(run_soda(accuracy).exit_code, kExitFile);
  EXPECT_EQ(read_file(report), "mine");
}

TEST_F(OutputFiles, AreNotWrittenThroughLinks) {
  const std::string other = folder_.file("other");
  write_file(other, "mine");
  fs::create_symlink(other, log_);
  EXPECT_EQ(run(log_).exit_code, kExitFile);
  EXPECT_EQ(run(log_, {"--force"}).exit_code, kExitOk);
  EXPECT_EQ(read_file(other), "mine");
  EXPECT_TRUE(fs::is_regular_file(fs::symlink_status(log_)));
}

TEST_F(OutputFiles, AreNeverWhatIsReadNorADevice) {
  const std::string before = read_file(scene_);
  EXPECT_EQ(run(scene_).exit_code, kExitInput);
  EXPECT_EQ(run(scene_, {"--force"}).exit_code, kExitInput);
  EXPECT_EQ(read_file(scene_), before);
  ASSERT_EQ(run(log_).exit_code, kExitOk);
  EXPECT_EQ(run_soda({"view", log_, "-o", log_, "--force"}).exit_code, kExitInput);
  EXPECT_EQ(run_soda({"replay", log_}).exit_code, kExitOk);
  const std::string fifo = folder_.file("fifo");
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  for (const std::string& place : {fifo, path(), std::string("/dev/null")})
    EXPECT_EQ(run(place, {"--force"}).exit_code, kExitFile) << place;
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

// The first to end has the name; the other says so, and its steps are there under another name.
TEST_F(OutputFiles, OfTwoRunsThatWriteOneLogOneIsThereWhole) {
  std::string partial;
  const Meanwhile beside{[] { alarm(100); },
                         [&](int child) {
                           partial = await_file(path(), ".partial", 4000);
                           EXPECT_EQ(run(log_).exit_code, kExitOk);
                           kill(child, SIGINT);
                         }};
  const ChildResult late = run_soda({"run", scene_, "--steps", "10000000", "--log", log_}, beside);
  EXPECT_EQ(late.exit_code, kExitFile) << late.err;
  EXPECT_TRUE(contains(late.err, partial)) << late.err;
  EXPECT_TRUE(contains(late.out, "digest")) << late.out;
  EXPECT_TRUE(contains(run_soda({"replay", log_}).out, " 3 steps replayed"));
  EXPECT_EQ(run_soda({"replay", partial, "--step", "1"}).exit_code, kExitOk);
}

TEST_F(OutputFiles, AKilledRunLeavesAPartialFileThatIsReadable) {
  std::string partial;
  const Meanwhile killed{[] { alarm(100); },
                         [&](int child) {
                           partial = await_file(path(), ".partial", 20000);
                           kill(child, SIGKILL);
                         }};
  EXPECT_EQ(run_soda({"run", scene_, "--steps", "10000000", "--log", log_}, killed).signal,
            SIGKILL);
  EXPECT_FALSE(fs::exists(log_));
  const ChildResult replay = run_soda({"replay", partial});
  EXPECT_EQ(replay.exit_code, kExitOk) << replay.err;
  EXPECT_TRUE(contains(replay.err, "cut off")) << replay.err;
  EXPECT_TRUE(contains(replay.out, "steps replayed without divergence")) << replay.out;
}

TEST_F(OutputFiles, OfAScenarioStayBelowItsFolder) {
  const TemporaryFolder outside;
  fs::create_directory(folder_.file("inner"));
  fs::create_directory_symlink(fs::path(outside.file("x")).parent_path(), folder_.file("out"));
  for (const std::string& log :
       {std::string("../a.sodalog"), std::string("inner/../../a.sodalog"),
        outside.file("a.sodalog"), std::string("out/a.sodalog"), std::string("inner/")}) {
    write_file(scene_, scene_with(R"("output": {"log": ")" + log + "\"},"));
    const ChildResult told = run_soda({"run", scene_});
    EXPECT_EQ(told.exit_code, kExitInput) << log << told.err;
    EXPECT_TRUE(contains(told.err, "scene.json:1:")) << told.err;
    EXPECT_TRUE(contains(told.err, "/output/log: found ")) << told.err;
  }
  EXPECT_EQ(files_in(fs::path(outside.file("x")).parent_path()), 0u);
  write_file(scene_, scene_with(R"("output": {"log": "inner/a.sodalog"},)"));
  const ChildResult ran = run_soda({"run", scene_});
  EXPECT_EQ(ran.exit_code, kExitOk) << ran.err;
  EXPECT_TRUE(fs::exists(folder_.file("inner/a.sodalog")));
  EXPECT_EQ(run_soda({"run", scene_}).exit_code, kExitFile);  // it exists now
  EXPECT_EQ(run_soda({"run", scene_, "--log", outside.file("b.sodalog")}).exit_code, kExitOk);
}

TEST(InputFiles, AFifoOrADeviceIsRefusedAndDoesNotBlock) {
  const TemporaryFolder folder;
  const std::string fifo = folder.file("fifo");
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  for (const std::string& place : {fifo, std::string("/dev/zero")})
    for (const char* command : {"run", "plan", "fuzz", "verify"}) {
      const ChildResult told = run_soda({command, place}, kNotForEver);
      EXPECT_EQ(told.exit_code, kExitFile) << command << told.err << " signal " << told.signal;
      EXPECT_TRUE(contains(told.err, "no regular file")) << told.err;
    }
  const std::string scene = folder.file("scene.json"), mesh = folder.file("mesh.stl");
  ASSERT_EQ(mkfifo(mesh.c_str(), 0600), 0);
  write_file(scene, scene_with(R"("statics": [{"name": "s", "material": "m", )"
                               R"("shape": {"type": "mesh", "file": "mesh.stl"}}],)"));
  const ChildResult told = run_soda({"run", scene}, kNotForEver);
  EXPECT_EQ(told.exit_code, kExitInput) << told.err << " signal " << told.signal;
  EXPECT_TRUE(contains(told.err, "no regular file")) << told.err;
}

TEST(InputFiles, AStreamOfInputsWithoutALineBreakIsGivenUp) {
  const ChildResult told = run_soda(
      {"run", library_file("border-stack"), "--steps", "20", "--inputs", "/dev/zero", "--realtime"},
      kNotForEver);
  EXPECT_EQ(told.exit_code, kExitInput) << told.err << " signal " << told.signal;
  EXPECT_TRUE(contains(told.err, "more than 1 MiB")) << told.err;
  EXPECT_LT(told.peak_rss_kib, 100 << 10);
}

TEST(InputFiles, AScenarioBeyondTheLimitIsRefusedByEveryCommand) {
  const TemporaryFolder folder;
  const std::string scene = folder.file("scene.json");
  write_file(scene, "");
  fs::resize_file(scene, std::size_t{257} << 20);  // takes no room
  for (const char* command : {"run", "plan", "fuzz", "verify"}) {
    const ChildResult told = run_soda({command, scene}, kNotForEver);
    EXPECT_EQ(told.exit_code, kExitInput) << command << told.err;
    EXPECT_TRUE(contains(told.err, "more than 256 MiB")) << command << told.err;
  }
}

}  // namespace
}  // namespace soda::analysis
