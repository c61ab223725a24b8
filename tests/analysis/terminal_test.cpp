// What gets to a terminal: no control characters from names, and a truthful line of progress.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <stdlib.h>
#include <unistd.h>

#include <array>
#include <ostream>
#include <sstream>
#include <stdexcept>

#include "analysis/child_process.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/printable_stream.hpp"
#include "analysis/text/progress.hpp"
#include "analysis/viewer/view_page.hpp"
#include "scenarios/printable.hpp"

namespace soda::analysis {
namespace {

using analysis_test::ChildResult;
using analysis_test::contains;
using analysis_test::read_file;
using analysis_test::run_soda;
using analysis_test::TemporaryFolder;
using analysis_test::write_file;

TEST(PrintableText, ShowsControlCharactersAndBytesThatAreNoText) {
  const auto shown = [](std::string_view text) { return scenarios::printable_text(text); };
  EXPECT_EQ(shown("plain \"text\"\n\tü € 😀"), "plain \"text\"\n\tü € 😀");
  EXPECT_EQ(shown("\x1b[2J\r\a\b"), "\\u001b[2J\\u000d\\u0007\\u0008");
  EXPECT_EQ(shown(std::string_view("\0\x7f", 2)), "\\u0000\\u007f");
  EXPECT_EQ(shown("\xc2\x9b"
                  "31m"),
            "\\u009b31m");                                // C1: CSI
  EXPECT_EQ(shown("\xff\xc3(\x9b"), "\\xFF\\xC3(\\x9B");  // no UTF-8
  EXPECT_EQ(shown("\xe2\x82"), "\\xE2\\x82");             // cut off
  EXPECT_EQ(shown("\xc1\x9b\xed\xa0\x80"), "\\xC1\\x9B\\xED\\xA0\\x80");
}

TEST(PrintableText, ComesOutOfAStreamAlikeInAnyPieces) {
  const std::string text = "a\x1b[0m\xc2\x9b ü€😀\xff\xe2\x82z\n\xf0\x9f";
  for (std::size_t piece = 1; piece <= text.size(); ++piece) {
    std::ostringstream to;
    {
      PrintableBuffer buffer(to.rdbuf());
      std::ostream out(&buffer);
      for (std::size_t at = 0; at < text.size(); at += piece) out << text.substr(at, piece);
    }
    EXPECT_EQ(to.str(), scenarios::printable_text(text)) << piece;
  }
}

bool has_control(const std::string& text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    if ((byte < 0x20 && byte != '\n' && byte != '\t') || byte == 0x7f) return true;
    if (byte == 0xc2 && i + 1 < text.size() && static_cast<unsigned char>(text[i + 1]) < 0xa0)
      return true;
  }
  return false;
}

std::string named_scene(const std::string& name) {
  return R"({"format": 1, "gravity_m_s2": [0, 0, -10], "time_step_s": 0.01, "steps": 2, )"
         R"("name": ")" +
         name + R"(", "materials": [{"name": ")" + name +
         R"(", "friction": 0.5, "restitution": 0}], "bodies": [{"id": 1, "shape": )"
         R"({"type": "sphere", "radius_m": 1}, "density_kg_m3": 1, "position_m": [0, 0, 0], )"
         R"("material": ")" +
         name + R"("}], "statics": [{"name": ")" + name +
         R"(", "shape": {"type": "halfspace", "normal": [0, 0, 1], "offset_m": -9}, )"
         R"("material": ")" +
         name + R"("}]})";
}

TEST(Names, DoNotSteerTheTerminal) {
  const TemporaryFolder folder;
  const std::string scene = folder.file("\x1b[31mred\x7f\xff.json");
  write_file(scene, named_scene("\\u001b]0;title\\u0007\\u009b2J\\u007f"));
  const std::string log = folder.file("\x1b[32m.sodalog");
  for (const auto& command : {std::vector<std::string>{"run", scene, "--log", log},
                              {"run", scene, "--json"},
                              {"plan", scene},
                              {"plan", scene, "--json"},
                              {"replay", log},
                              {"view", log},
                              {"verify", scene, "--seeds", "1", "--threads", "1"},
                              {"run", scene + "\x1b[33m"},
                              {"run", scene, "--log", log},
                              {"\x1b[34m"},
                              {"run", scene, "--\x1b[35m"}}) {
    const ChildResult said = run_soda(command);
    EXPECT_FALSE(has_control(said.out)) << command[0] << said.out;
    EXPECT_FALSE(has_control(said.err)) << command[0] << said.err;
    EXPECT_NE(said.exit_code, kExitInternal) << said.err;
    EXPECT_FALSE(said.out.empty() && said.err.empty());
  }
  const ChildResult ran = run_soda({"run", scene});
  EXPECT_EQ(ran.exit_code, kExitOk) << ran.err;
  EXPECT_TRUE(contains(ran.out, "\\u001b]0;title\\u0007\\u009b2J\\u007f: 1 bodies")) << ran.out;
  const ChildResult broken = run_soda({"plan", scene + "\x1b[33m"});
  EXPECT_TRUE(contains(broken.err, "\\u001b[31mred\\u007f\\xFF.json\\u001b[33m")) << broken.err;
}

std::size_t count(const std::string& part, const std::string& text) {
  std::size_t found = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1))
    ++found;
  return found;
}

// The same page but for the title and what it shows, whatever the name.
TEST(Names, DoNotBreakThePage) {
  Recording plain;
  plain.name = "plain";
  const std::string page = view_page(plain, {});
  for (const std::string& name :
       {std::string("{{recording}}"), std::string("{{script}} {{title}} {{other}}"),
        std::string("</script><script>alert(1)</script>"), std::string("</title><b>")}) {
    Recording recording;
    recording.name = name;
    const std::string named = view_page(recording, {});
    EXPECT_EQ(count("<script", named), count("<script", page)) << name;
    EXPECT_EQ(count("</script>", named), count("</script>", page)) << name;
    EXPECT_EQ(count("<b>", named), count("<b>", page)) << name;
    const std::size_t begin = named.find("<title>") + 7;
    const std::string title = named.substr(begin, named.find("</title>") - begin);
    if (name[0] == '{') {
      EXPECT_EQ(title, name);
    }
    const std::string mark = "type=\"text/plain\">";
    const std::size_t data = named.find(mark) + mark.size();
    const std::size_t end = named.find_first_not_of(
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/=", data);
    EXPECT_EQ(named.substr(end, 9), "</script>") << name;
    EXPECT_GT(end, data + 100) << name;
  }
}

TEST(Progress, SaysWhenTheTimeLeftIsUnknown) {
  ProgressEstimate estimate(600);
  EXPECT_EQ(estimate.text(0.0), "step 0 of 600 after 0 s, time left unknown");
  EXPECT_EQ(estimate.text(7.5), "step 0 of 600 after 7.5 s, time left unknown");
  estimate.note(0, 8.0);
  EXPECT_EQ(estimate.rate(8.0), 0.0);
}

TEST(Progress, GoesByTheRateOfLateNotByTheMean) {
  ProgressEstimate estimate(1000);
  for (int i = 1; i <= 500; ++i) estimate.note(i, 0.01 * i);  // 100 steps/s for 5 s
  EXPECT_NEAR(estimate.rate(5.0), 100.0, 1e-9);
  for (int i = 1; i <= 40; ++i) estimate.note(500 + i, 5.0 + i);  // then 1 step/s
  EXPECT_NEAR(estimate.rate(45.0), 1.0, 0.11);
  EXPECT_EQ(estimate.text(45.0), "step 540 of 1000 after 45 s, 1 steps/s, 4.6e+02 s left");
}

// A step that takes long: the time goes on, the rate falls, what is left grows.
TEST(Progress, TicksWhileAStepTakesLong) {
  ProgressEstimate estimate(100);
  for (int i = 1; i <= 60; ++i) estimate.note(i, 0.1 * i);
  double before = estimate.rate(6.0);
  EXPECT_NEAR(before, 10.0, 1e-9);
  for (const double now : {10.0, 20.0, 100.0, 1000.0}) {
    EXPECT_LT(estimate.rate(now), before);
    EXPECT_GT(estimate.rate(now), 0.0);
    before = estimate.rate(now);
  }
  estimate.note(61, 1000.0);  // steps of 994 s: what was before no longer counts
  EXPECT_NEAR(estimate.rate(1000.0), 1.0 / 994.0, 1e-4);
}

// A terminal that the test holds the other end of.
class PseudoTerminal {
 public:
  PseudoTerminal() : end_(posix_openpt(O_RDWR | O_NOCTTY)) {
    if (end_ < 0 || grantpt(end_) != 0 || unlockpt(end_) != 0) throw std::runtime_error("no pty");
  }
  ~PseudoTerminal() { close(end_); }
  PseudoTerminal(const PseudoTerminal&) = delete;

  void become_input_and_output() const {
    const int other = open(ptsname(end_), O_RDWR | O_NOCTTY);
    dup2(other, STDIN_FILENO);
    dup2(other, STDOUT_FILENO);
  }
  void type(const std::string& text) const {
    if (write(end_, text.data(), text.size()) < 0) throw std::runtime_error("nobody reads");
  }
  // What is shown until `awaited` is, or for 30 s.
  std::string shown_until(const std::string& awaited) const {
    std::string shown;
    std::array<char, 4096> buffer{};
    pollfd ready{end_, POLLIN, 0};
    while (!contains(shown, awaited) && poll(&ready, 1, 30'000) > 0) {
      const ssize_t count = read(end_, buffer.data(), buffer.size());
      if (count <= 0) break;
      shown.append(buffer.data(), static_cast<std::size_t>(count));
    }
    return shown;
  }

 private:
  const int end_;
};

TEST(InteractiveReplay, GreetsPromptsAndCompletesOnATerminal) {
  const TemporaryFolder folder;
  const std::string log = folder.file("run.sodalog");
  ASSERT_EQ(run_soda({"run", analysis_test::library_file("border-stack"), "--steps", "20", "--log",
                      log, "--log-level", "trace"})
                .exit_code,
            kExitOk);
  const PseudoTerminal terminal;
  std::string greeting, happening;
  const ChildResult ended = run_soda({"replay", log, "--interactive"},
                                     {[&terminal] {
                                        setenv("TERM", "xterm", 1);
                                        terminal.become_input_and_output();
                                      },
                                      [&](int) {
                                        greeting = terminal.shown_until("(soda) ");
#ifdef SODA_HAS_LIBEDIT
                                        terminal.type("ne\t\n");
#else
                                        terminal.type("next\n");
#endif
                                        happening = terminal.shown_until("happening 1 of ");
                                        terminal.type("nonsense\nquit\n");
                                      }});
  EXPECT_TRUE(contains(greeting, "help lists the commands")) << greeting;
  EXPECT_TRUE(contains(happening, "happening 1 of ")) << happening;
  EXPECT_TRUE(contains(ended.err, "unknown command nonsense")) << ended.err;
  EXPECT_EQ(ended.exit_code, kExitOk);  // who types may err
}

}  // namespace
}  // namespace soda::analysis
