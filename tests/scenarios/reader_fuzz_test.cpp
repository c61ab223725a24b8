// Bytes of library files, changed at random: the reader must answer with a scenario or an
// InputError, soon. SODA_FUZZ_SECONDS (60) and SODA_FUZZ_SEED (1) repeat or lengthen a run.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>

#include "scenarios/random.hpp"
#include "tests/scenarios/scenario_texts.hpp"

namespace soda::scenarios {
namespace {

std::uint64_t from_environment(const char* name, std::uint64_t otherwise) {
  const char* value = std::getenv(name);
  return value ? std::strtoull(value, nullptr, 10) : otherwise;
}

std::size_t below(RandomStream& stream, std::size_t limit) {
  return limit == 0 ? 0 : static_cast<std::size_t>(next_bits(stream) % limit);
}

constexpr std::string_view kWords[] = {"0",
                                       "-1",
                                       "1e308",
                                       "1e999",
                                       "-0.0",
                                       "NaN",
                                       "null",
                                       "true",
                                       "[]",
                                       "{}",
                                       "\"\"",
                                       "[",
                                       "}",
                                       ",",
                                       ":",
                                       "\"",
                                       "\\",
                                       "\\u0000",
                                       "\xFF",
                                       "9999999999",
                                       "1e-9",
                                       "\"box\"",
                                       "[1,2,3]",
                                       "\"mesh\"",
                                       "//",
                                       "2147483647",
                                       "1000000",
                                       "0.5e1",
                                       "\xF0\x9F\x98\x80"};

void mutate(std::string& text, const std::vector<std::string>& corpus, RandomStream& stream) {
  const std::size_t at = below(stream, text.size() + 1);
  const std::size_t length = std::min(below(stream, 40), text.size() - at);
  switch (below(stream, 6)) {
    case 0:
      if (at < text.size()) text[at] = static_cast<char>(next_bits(stream));
      break;
    case 1:
      text.erase(at, length);
      break;
    case 2:
      text.insert(at, kWords[below(stream, std::size(kWords))]);
      break;
    case 3:
      text.insert(at, text.substr(at, length));
      break;
    case 4: {
      // A digit for a digit keeps the file well-formed, so that its meaning is what changes.
      const std::size_t digit = text.find_first_of("0123456789", at);
      if (digit != text.npos) text[digit] = static_cast<char>('0' + below(stream, 10));
      break;
    }
    default: {
      const std::string& other = corpus[below(stream, corpus.size())];
      const std::size_t from = below(stream, other.size());
      text.replace(at, length, other.substr(from, below(stream, 200)));
    }
  }
}

TEST(ReaderFuzz, FindsNothingButScenariosAndInputErrors) {
  std::vector<std::string> corpus = {std::string(kSmallScenario)};
  for (const auto& file : library_files()) corpus.push_back(file_bytes(file));
  for (const auto& file : case_files()) corpus.push_back(file_bytes(file));
  const std::string file = (library_folder() / "fuzzed.json").string();

  const auto seconds = from_environment("SODA_FUZZ_SECONDS", 60);
  const std::uint64_t seed = from_environment("SODA_FUZZ_SEED", 1);
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::seconds(seconds);
  std::uint64_t runs = 0, read = 0;
  for (; Clock::now() < end; ++runs) {
    RandomStream stream = make_stream(seed, runs);
    std::string text = corpus[below(stream, corpus.size())];
    for (std::size_t edits = 1 + below(stream, 4); edits > 0; --edits) {
      mutate(text, corpus, stream);
    }
    const auto start = Clock::now();
    try {
      read_scenario_text(text, file);
      ++read;
    } catch (const InputError& error) {
      ASSERT_FALSE(error.faults().empty());
    }
    const std::chrono::duration<double> took = Clock::now() - start;
    ASSERT_LT(took.count(), 20.0) << "seed " << seed << " run " << runs;
  }
  RecordProperty("runs", static_cast<int>(runs));
  RecordProperty("read", static_cast<int>(read));
  EXPECT_GT(read, runs / 100) << runs;
}

}  // namespace
}  // namespace soda::scenarios
