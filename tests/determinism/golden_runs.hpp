// Whole runs of the library and case scenes, in sequence and undivided, and their stored digests.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

namespace soda::test {

struct GoldenRun {
  std::string scene;  // "library/pyramid"
  std::int64_t steps = 0;
  std::uint64_t last = 0;  // digest of the state after the last step: what `soda run` prints
  std::uint64_t steps_digest = 0;  // digest of the digests after every step
  std::int64_t first_steps = 0;    // what code that is not optimised runs in a second or few
  std::uint64_t first_digest = 0;  // digest of the digests after each of them

  bool operator==(const GoldenRun&) const = default;
};

// Every scene of scenarios/library and scenarios/cases, in the order of their names.
std::vector<std::string> golden_scenes();
std::string scene_file(const std::string& scene);

// Runs all steps of the scene.
GoldenRun golden_run(const std::string& scene);

// Runs `steps` of it; returns the digest of the digests after each.
std::uint64_t digest_of_first_steps(const std::string& scene, std::int64_t steps);

// tests/golden/digests.txt, a line a run; update.sh writes it.
std::vector<GoldenRun> stored_runs();
std::string to_line(const GoldenRun& run);

std::ostream& operator<<(std::ostream& out, const GoldenRun& run);  // for messages of tests
std::string test_name(const GoldenRun& run);                        // "library_pyramid"

}  // namespace soda::test
