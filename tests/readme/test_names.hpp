// Which tests a page tells a reader to run, and which there are.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace soda::readme {

struct TestSelection {
  std::size_t line = 0;      // 1-based
  std::string pattern;       // of a test's whole name, with * and ?; of ctest, what it contains
  bool is_of_ctest = false;  // a regular expression of `ctest -R`
};

// Each pattern of `--gtest_filter=` that selects tests, and each expression of `ctest -R`; in code
// and prose alike.
std::vector<TestSelection> test_selections_of(const std::string& text);

// The names of GoogleTest tests in a source. Tests with parameters have a name for each prefix that
// they are instantiated with there, and a * for the parameter, which is known at run time only.
std::vector<std::string> tests_of_source(const std::string& source);

// The names that a CMakeLists.txt gives by add_test(), with a * for each variable; none that is a
// variable as a whole.
std::vector<std::string> tests_of_cmake(const std::string& text);

// Whether it selects one of the tests, whatever stands for their *.
bool selects_any(const TestSelection& selection, const std::vector<std::string>& tests);

}  // namespace soda::readme
