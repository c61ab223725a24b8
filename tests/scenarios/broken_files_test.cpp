#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "scenarios/random.hpp"
#include "tests/scenarios/scenario_texts.hpp"

namespace soda::scenarios {
namespace {

// A text that is no JSON; '@' marks where the fault must be found and is taken out.
struct SyntaxCase {
  const char* name;
  std::string_view text;
  const char* pointer;
  const char* found;
};

void PrintTo(const SyntaxCase& syntax, std::ostream* out) { *out << syntax.name; }

class BrokenSyntax : public testing::TestWithParam<SyntaxCase> {};

TEST_P(BrokenSyntax, IsOneFaultAtItsPlace) {
  std::string text(GetParam().text);
  const std::size_t mark = text.find('@');
  ASSERT_NE(mark, std::string::npos);
  text.erase(mark, 1);
  const auto line = static_cast<std::size_t>(std::count(text.begin(), text.begin() + mark, '\n'));
  const std::size_t newline = text.substr(0, mark).rfind('\n');
  const auto faults = faults_of(text);
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0].line, line + 1);
  EXPECT_EQ(faults[0].column, newline == std::string::npos ? mark + 1 : mark - newline);
  EXPECT_EQ(faults[0].pointer, GetParam().pointer);
  EXPECT_NE(faults[0].found.find(GetParam().found), std::string::npos) << faults[0].found;
}

const SyntaxCase kSyntaxCases[] = {
    {"Empty", "@", "", "an empty file"},
    {"OnlySpace", "  \n\t @", "", "an empty file"},
    {"NaN", "{\"format\": 1,\n \"x\": @NaN}", "/x", "NaN"},
    {"Infinity", "{\"x\": [1, @Infinity]}", "/x/1", "Infinity"},
    {"MinusInfinity", "{\"x\": @-Infinity}", "/x", "-Infinity"},
    {"NumberTooLarge", "{\"x\":\n[0, @1e999]}", "/x/1", "1e999"},
    {"NumberTooLargeNegative", "{\"x\": @-1e400}", "/x", "-1e400"},
    {"TrailingCommaInArray", "{\"x\": [1, 2, @]}", "/x/2", "]"},
    {"TrailingCommaInObject", "{\"x\": 1, @}", "", "}"},
    {"CommentLine", "{@// comment\n}", "", "//"},
    {"CommentBlock", "{\"x\": @/* one */ 1}", "/x", "/*"},
    {"SingleQuotes", "{@'x': 1}", "", "'x'"},
    {"KeyWithoutQuotes", "{@x: 1}", "", "x"},
    {"MissingComma", "{\"x\": 1 @\"y\": 2}", "", "\""},
    {"MissingColon", "{\"x\" @1}", "/x", "1"},
    {"MissingValue", "{\"x\": @}", "/x", "}"},
    {"LeadingZero", "{\"x\": @01}", "", "01"},
    {"LeadingPlus", "{\"x\": @+1}", "/x", "+1"},
    {"LeadingPoint", "{\"x\": @.5}", "/x", ".5"},
    {"Hexadecimal", "{\"x\": @0x10}", "", "0x10"},
    {"WrongLiteral", "{\"x\": @True}", "/x", "True"},
    {"CutLiteral", "{\"x\": @tru}", "/x", "tru"},
    {"TwoDocuments", "{} @{}", "", "{"},
    {"WrongBracket", "{\"x\": [1, 2@}", "/x/2", "}"},
    {"OpenString", "{\"x\": \"abc@", "/x", "end of the file"},
    {"LineBreakInString", "{\"x\": \"ab@\nc\"}", "/x", "\\u000a"},
    {"ByteThatIsNotUtf8", "{\"x\": \"ab@\xFF\"}", "/x", "\\xFF"},
    {"OverlongUtf8", "{\"x\": \"ab@\xC0\x80\"}", "/x", "not UTF-8"},
    {"ControlCharacter", "{\"x\": \"ab@\x01\"}", "/x", "\\u0001"},
    {"Utf16", "@\xFF\xFE{", "", "\\xFF\\xFE"},
};

INSTANTIATE_TEST_SUITE_P(Reader, BrokenSyntax, testing::ValuesIn(kSyntaxCases),
                         [](const auto& syntax) { return std::string(syntax.param.name); });

TEST(BrokenFile, CutOffAnywhereIsOneFaultAtTheEndOrTheLastWord) {
  for (std::size_t size = 0; size < kSmallScenario.size(); ++size) {
    const auto faults = faults_of(kSmallScenario.substr(0, size));
    ASSERT_EQ(faults.size(), 1u) << "cut at " << size;
    ASSERT_GT(faults[0].line, 0u) << "cut at " << size;
    ASSERT_NE(faults[0].found.find(size == 0 ? "empty" : "end of the file"), std::string::npos)
        << "cut at " << size << ": " << faults[0].found;
  }
}

TEST(BrokenFile, NestedDeeperThanTheLimitIsAFaultAtTheFirstBracketTooMany) {
  for (const std::string& bracket : {std::string("["), std::string("{\"a\":")}) {
    std::string text;
    for (int i = 0; i < 200'000; ++i) text += bracket;
    const auto faults = faults_of(text);
    ASSERT_EQ(faults.size(), 1u);
    EXPECT_EQ(faults[0].line, 1u);
    EXPECT_EQ(faults[0].column, 64 * bracket.size() + 1);
    EXPECT_NE(faults[0].allowed.find("64 levels"), std::string::npos);
  }
}

TEST(BrokenFile, BinaryGarbageIsOneFault) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    RandomStream stream = make_stream(seed, 0);
    std::string text(1 + next_bits(stream) % 2000, '\0');
    for (char& c : text) c = static_cast<char>(next_bits(stream));
    const auto faults = faults_of(text);
    ASSERT_EQ(faults.size(), 1u) << "seed " << seed;
    for (const char c : faults[0].found) ASSERT_GE(static_cast<unsigned char>(c), 0x20);
  }
}

TEST(BrokenFile, WithoutAnObjectOnTopIsAFault) {
  for (const std::string_view text : {"[1]", "1", "\"scenario\"", "null", "true", "-0.5"}) {
    const auto faults = faults_of(text);
    ASSERT_EQ(faults.size(), 1u) << text;
    EXPECT_EQ(faults[0].line, 1u);
    EXPECT_EQ(faults[0].column, 1u);
    EXPECT_EQ(faults[0].allowed, "an object (scenario)");
  }
}

TEST(BrokenFile, WithMillionsOfValuesIsRefused) {
  std::string text = "[0";
  for (int i = 0; i < 4'100'000; ++i) text += ",0";
  const auto faults = faults_of(text + "]");
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_NE(faults[0].found.find("more than 4000000 values"), std::string::npos);
}

TEST(BrokenFile, WithManyUnknownAndEqualKeysIsReadInLinearTime) {
  std::string text = "{\"format\": 1";
  for (int i = 0; i < 200'000; ++i) text += ",\"a\": 1";
  EXPECT_FALSE(faults_of(text + "}").empty());
}

// A folder of its own for the files of one test.
class FileOnDisk : public testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        std::filesystem::path(testing::TempDir()) / ("soda_files_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string write(const std::string& name, std::string_view text) const {
    const auto path = folder_ / name;
    std::ofstream(path, std::ios::binary) << text;
    return path.string();
  }

  std::filesystem::path folder_;
};

TEST_F(FileOnDisk, IsNamedByItsStemUnlessTheFileGivesAName) {
  EXPECT_EQ(read_scenario_file(write("my.scene.json", kSmallScenario)).name, "my.scene");
  const std::string named =
      replaced(kSmallScenario, "\"format\": 1", "\"format\": 1, \"name\": \"Own name\"");
  EXPECT_EQ(read_scenario_file(write("a.json", named)).name, "Own name");
}

TEST_F(FileOnDisk, WithAByteOrderMarkIsRead) {
  EXPECT_NO_THROW(
      read_scenario_file(write("a.json", "\xEF\xBB\xBF" + std::string(kSmallScenario))));
  const auto faults = faults_of("\xEF\xBB\xBF{\"a\": NaN}");
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0].column, 7u);
}

TEST_F(FileOnDisk, MissingIsAFileErrorThatNamesItAndTheReason) {
  const std::string path = (folder_ / "missing.json").string();
  try {
    read_scenario_file(path);
    FAIL();
  } catch (const FileError& error) {
    EXPECT_EQ(error.what(), path + ": cannot be read: No such file or directory");
  }
}

TEST_F(FileOnDisk, ThatIsADirectoryIsAFileError) {
  EXPECT_THROW(read_scenario_file(folder_.string()), FileError);
}

TEST_F(FileOnDisk, WithoutPermissionIsAFileError) {
  if (geteuid() == 0) GTEST_SKIP() << "root may read everything";
  const std::string path = write("secret.json", kSmallScenario);
  std::filesystem::permissions(path, std::filesystem::perms::none);
  EXPECT_THROW(read_scenario_file(path), FileError);
}

TEST_F(FileOnDisk, WithAZeroByteInItsNameIsAFileError) {
  EXPECT_THROW(read_scenario_file(std::string("a\0b.json", 8)), FileError);
}

TEST_F(FileOnDisk, ThatNeverEndsIsRefused) {
  EXPECT_THROW(read_scenario_file("/dev/zero"), FileError);
}

class MeshOnDisk : public FileOnDisk {
 protected:
  // The faults of the small scenario whose ramp comes from `file`.
  std::vector<InputFault> faults_with_mesh(const std::string& file) const {
    const std::string text =
        replaced(kSmallScenario,
                 "\"vertices_m\": [[0, 0, 0], [1, 0, 0], [0, 1, 0]],\n               "
                 "\"triangles\": [[0, 1, 2]]",
                 "\"file\": \"" + file + "\"");
    return faults_of(text, (folder_ / "scene.json").string());
  }
};

TEST_F(MeshOnDisk, IsLookedUpBesideTheScenario) {
  write("one.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_TRUE(faults_with_mesh("one.obj").empty());
}

TEST_F(MeshOnDisk, ThatCannotBeUsedIsAFaultAtItsName) {
  write("empty.obj", "");
  write("points.obj", "v 0 0 0\nv 1 0 0\n");
  write("line.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n");
  write("index.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n");
  write("nan.obj", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  write("huge.obj", "v 0 0 0\nv 1e30 0 0\nv 0 1 0\nf 1 2 3\n");
  write("garbage.stl", "\x01\x02 no mesh at all");
  write("cut.stl", std::string(80, ' ') + std::string("\xFF\xFF\x00\x00", 4) + "abc");
  write("mesh.ply", "ply\n");
  std::filesystem::create_directories(folder_ / "folder.obj");
  for (const char* name :
       {"empty.obj", "points.obj", "line.obj", "index.obj", "nan.obj", "huge.obj", "garbage.stl",
        "cut.stl", "mesh.ply", "folder.obj", "missing.obj", "a\\u0000.obj"}) {
    const auto faults = faults_with_mesh(name);
    ASSERT_EQ(faults.size(), 1u) << name;
    EXPECT_EQ(faults[0].pointer, "/statics/1/shape/file") << name;
    EXPECT_EQ(faults[0].line, 22u) << name;
  }
}

}  // namespace
}  // namespace soda::scenarios
