// Prints the lines of tests/golden/digests.txt; see tests/golden/update.sh.
#include <iostream>

#include "tests/determinism/golden_runs.hpp"

int main() {
  for (const std::string& scene : soda::test::golden_scenes())
    std::cout << to_line(soda::test::golden_run(scene)) << std::endl;
}
