// `soda scaling`, and what `soda run` says of speed-ups and processors' time.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "analysis/child_process.hpp"

namespace soda::analysis {
namespace {

using analysis_test::ChildResult;
using analysis_test::library_file;
using analysis_test::run_soda;
using analysis_test::TemporaryFolder;
using Json = nlohmann::json;

Json parsed(const std::vector<std::string>& arguments) {
  const ChildResult result = run_soda(arguments);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  return Json::parse(result.out);
}

double sum_s(const Json& account) {
  double sum = 0.0;
  for (const auto& [name, seconds] : account.items()) sum += seconds.get<double>();
  return sum;
}

void expect_closed(const Json& point) {
  const double all_s = point["processors"].get<double>() * point["makespan_s"].get<double>();
  EXPECT_NEAR(sum_s(point["account"]), all_s, 1e-9 * all_s) << point;
}

TEST(RunOnTheCluster, SaysWhatOneProcessorWithOneWorldTakes) {
  const Json one = parsed({"run", library_file("five-worlds-chain"), "--steps", "30", "--executor",
                           "virtual", "--worlds", "1", "--json"})["virtual"];
  const Json five = parsed({"run", library_file("five-worlds-chain"), "--steps", "30", "--executor",
                            "virtual", "--json"})["virtual"];
  EXPECT_EQ(one["one_processor_s"], five["one_processor_s"]);
  EXPECT_DOUBLE_EQ(five["speed_up"].get<double>(),
                   five["one_processor_s"].get<double>() / five["makespan_s"].get<double>());
  // Each world solves the one island.
  EXPECT_LT(five["speed_up"], 1.5);
  EXPECT_GT(five["account"]["replicated_s"], five["account"]["useful_s"]);
  // Beside the work, one world on the cluster keeps checkpoints and takes part in GVT.
  EXPECT_DOUBLE_EQ(one["account"]["useful_s"].get<double>(), one["one_processor_s"].get<double>());
  EXPECT_GT(one["account"]["checkpoints_s"], 0);
  EXPECT_GT(one["account"]["gvt_s"], 0);
  EXPECT_EQ(one["account"]["replicated_s"], 0);
  EXPECT_EQ(one["account"]["rolled_back_s"], 0);
  expect_closed(one);
  expect_closed(five);
}

TEST(RunOnTheCluster, UsefulWorkOfADividedRunIsThatOfTheUndividedOne) {
  for (const char* scene : {"twelve-worlds", "five-worlds-chain", "detection-only"}) {
    // In lockstep nothing is taken over from what was rolled back.
    const Json cluster =
        parsed({"run", library_file(scene), "--steps", "40", "--worlds", "5", "--executor",
                "virtual", "--policy", "lockstep", "--json"})["virtual"];
    const double one_s = cluster["one_processor_s"].get<double>();
    EXPECT_NEAR(cluster["account"]["useful_s"].get<double>(), one_s, 0.02 * one_s) << scene;
    EXPECT_EQ(cluster["account"]["checkpoints_s"], 0) << scene;
  }
}

TEST(ScalingCommand, ReportsEveryDocumentedKeyTwiceTheSame) {
  const std::vector<std::string> command = {
      "scaling",   library_file("border-stack"),  "--worlds", "1,2,4", "--steps", "20",
      "--against", "lockstep,invalidate,ungated", "--json"};
  const ChildResult once = run_soda(command);
  ASSERT_EQ(once.exit_code, 0) << once.err;
  EXPECT_EQ(once.out, run_soda(command).out);
  const Json json = Json::parse(once.out);
  for (const char* key : {"network", "latency_s", "bandwidth_bytes_s", "source", "curves", "equal"})
    EXPECT_TRUE(json.contains(key)) << key;
  EXPECT_EQ(json["equal"], true);
  ASSERT_EQ(json["curves"].size(), 1u);
  const Json& curve = json["curves"][0];
  EXPECT_EQ(curve["scenario"], "border-stack");
  EXPECT_EQ(curve["steps"], 20);
  EXPECT_EQ(curve["weak"], false);
  ASSERT_EQ(curve["points"].size(), 3u);
  for (const Json& point : curve["points"]) {
    for (const char* key :
         {"worlds", "processors", "bodies", "one_processor_s", "makespan_s", "speed_up",
          "efficiency", "messages", "account", "against", "execution_digest", "equal"})
      EXPECT_TRUE(point.contains(key)) << key;
    for (const char* rival : {"lockstep", "invalidate", "ungated"})
      EXPECT_GT(point["against"][rival]["speed_up"], 0.0);
    EXPECT_EQ(point["one_processor_s"], curve["points"][0]["one_processor_s"]);
    expect_closed(point);
  }
}

TEST(ScalingCommand, TheSpeedUpIsThatOfARun) {
  const Json point = parsed({"scaling", library_file("crowd"), "--worlds", "4", "--steps", "10",
                             "--network", "ten-gbe", "--json"})["curves"][0]["points"][0];
  const Json run =
      parsed({"run", library_file("crowd"), "--worlds", "4", "--steps", "10", "--executor",
              "virtual", "--latency-us", "20", "--bandwidth-mb-s", "1250", "--json"})["virtual"];
  for (const char* key : {"makespan_s", "one_processor_s", "speed_up", "execution_digest"})
    EXPECT_EQ(point[key], run[key]) << key;
}

TEST(ScalingCommand, ANearNetworkGainsMoreThanAFarOne) {
  double before = 1e9;
  for (const char* network : {"shared", "infiniband", "ten-gbe", "internet"}) {
    const Json point = parsed({"scaling", library_file("twelve-worlds"), "--network", network,
                               "--json"})["curves"][0]["points"][0];
    EXPECT_LT(point["speed_up"], before) << network;
    before = point["speed_up"];
  }
}

TEST(ScalingCommand, AWeakSceneGrowsWithItsWorlds) {
  const Json json = parsed({"scaling", library_file("ragdolls"), "--weak", "--worlds", "1,2,4",
                            "--steps", "10", "--json"});
  const Json& points = json["curves"][0]["points"];
  ASSERT_EQ(points.size(), 3u) << json;
  EXPECT_EQ(json["equal"], true);
  for (const Json& point : points) {
    EXPECT_EQ(point["bodies"].get<int>(),
              point["worlds"].get<int>() * points[0]["bodies"].get<int>());
    EXPECT_GT(point["one_processor_s"].get<double>(),
              0.9 * point["worlds"].get<double>() * points[0]["one_processor_s"].get<double>());
  }
  const Json inputs =
      parsed({"scaling", library_file("user-input"), "--weak", "--json"})["curves"][0];
  EXPECT_TRUE(inputs["points"].empty());
  EXPECT_EQ(inputs["left_out"], "it has user input");
}

TEST(ScalingCommand, ALibraryIsOneTableAndAPageHoldsPictures) {
  const TemporaryFolder folder;
  for (const char* name : {"twelve-worlds", "eight-corner"}) {
    std::ifstream in(library_file(name));
    std::ofstream(folder.file(std::string(name) + ".json")) << in.rdbuf();
  }
  const std::string page = folder.file("scaling.html");
  const ChildResult result = run_soda({"scaling", "--library", folder.file(""), "--worlds", "1,8",
                                       "--steps", "5", "--csv", "-o", page});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(std::count(result.out.begin(), result.out.end(), '\n'), 1 + 4) << result.out;
  const std::string html = analysis_test::read_file(page);
  EXPECT_TRUE(analysis_test::contains(html, "<svg"));
  EXPECT_TRUE(analysis_test::contains(html, "<code>soda scaling --library " + folder.file("") +
                                                " --worlds 1,8 --steps 5 --csv -o " + page +
                                                "</code>"));
  EXPECT_EQ(run_soda({"scaling", "--library", folder.file(""), "-o", page}).exit_code, 3);
}

TEST(ScalingCommand, BadArgumentsAreRefusedWithWhatIsAllowed) {
  const auto refused = [](std::vector<std::string> more, const char* what) {
    std::vector<std::string> command = {"scaling", library_file("twelve-worlds")};
    command.insert(command.end(), more.begin(), more.end());
    const ChildResult result = run_soda(command);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_NE(result.err.find(what), std::string::npos) << result.err;
  };
  refused({"--worlds", "1,x"}, "--worlds: found x");
  refused({"--worlds", "0"}, "--worlds: found 0");
  refused({"--worlds", "10001"}, "allowed: numbers from 1 to 10000");
  refused({"--worlds", "2,"}, "--worlds: found ");
  refused({"--network", "infinband"}, "did you mean infiniband?");
  refused({"--against", "lockstep,all"}, "--against: found all");
  EXPECT_EQ(run_soda({"scaling"}).exit_code, 2);
  EXPECT_EQ(run_soda({"scaling", "--library", "/no/such/folder"}).exit_code, 3);
}

}  // namespace
}  // namespace soda::analysis
