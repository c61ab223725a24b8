// Entry point of `soda`: every error becomes an exit code here.
#include <iostream>

#include "analysis/command_line.hpp"
#include "analysis/exit_codes.hpp"
#include "scenarios/read_scenario.hpp"

namespace {

int failed(const std::exception& error, int code) {
  std::cerr << "soda: " << error.what() << "\n";
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace soda;
  try {
    const int code = analysis::run_command_line(argc, argv, std::cout, std::cerr);
    if (!std::cout.flush()) throw scenarios::FileError("standard output cannot be written");
    return code;
  } catch (const analysis::CheckFailed& error) {
    return failed(error, analysis::kExitCheckFailed);
  } catch (const analysis::UsageError& error) {
    return failed(error, analysis::kExitInput);
  } catch (const scenarios::InputError& error) {
    std::cerr << error.what() << "\n";  // its lines start with the file's name
    return analysis::kExitInput;
  } catch (const scenarios::FileError& error) {
    return failed(error, analysis::kExitFile);
  } catch (const analysis::NumericalFailure& error) {
    return failed(error, analysis::kExitNumerical);
  } catch (const std::exception& error) {
    return failed(error, analysis::kExitInternal);
  }
}
