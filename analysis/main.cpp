// Entry point of `soda`: every error becomes an exit code here.
#include <iostream>

#include "analysis/command_line.hpp"
#include "analysis/exit_codes.hpp"
#include "analysis/job.hpp"
#include "kernel/executor.hpp"
#include "scenarios/read_scenario.hpp"

namespace {

using namespace soda;

analysis::Ending failed(const std::exception& error, int code) {
  return {code, std::string("soda: ") + error.what() + "\n"};
}

analysis::Ending run(int argc, char** argv, kernel::Transport* transport) {
  try {
    std::ostream nowhere(nullptr);
    const bool speaks = transport == nullptr || transport->is_root();
    const int code = analysis::run_command_line(argc, argv, transport, speaks ? std::cout : nowhere,
                                                speaks ? std::cerr : nowhere);
    if (!std::cout.flush()) throw scenarios::FileError("standard output cannot be written");
    return {code, ""};
  } catch (const kernel::PeerFailed& failure) {
    return {failure.code, "", true};
  } catch (const analysis::CheckFailed& error) {
    return failed(error, analysis::kExitCheckFailed);
  } catch (const analysis::UsageError& error) {
    return failed(error, analysis::kExitInput);
  } catch (const scenarios::InputError& error) {
    return {analysis::kExitInput, std::string(error.what()) + "\n"};  // starts with the file's name
  } catch (const scenarios::FileError& error) {
    return failed(error, analysis::kExitFile);
  } catch (const kernel::ThreadsNotStarted& error) {
    return failed(error, analysis::kExitFile);
  } catch (const analysis::NumericalFailure& error) {
    return failed(error, analysis::kExitNumerical);
  } catch (const std::exception& error) {
    return failed(error, analysis::kExitInternal);
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::unique_ptr<kernel::Transport> transport;
  try {
    transport = analysis::join_job();
  } catch (const std::exception& error) {
    return analysis::end_job(nullptr, failed(error, analysis::kExitInput), std::cerr);
  }
  const analysis::Ending ending = run(argc, argv, transport.get());
  return analysis::end_job(transport.get(), ending, std::cerr);
}
