// Entry point of `soda`: every error becomes an exit code here.
#include <malloc.h>

#include <csignal>
#include <iostream>
#include <new>

#include "analysis/commands/command_line.hpp"
#include "analysis/process/job.hpp"
#include "analysis/text/exit_codes.hpp"
#include "analysis/text/printable_stream.hpp"
#include "kernel/api/executor.hpp"
#include "scenarios/read_scenario.hpp"

namespace {

using namespace soda;
using analysis::PrintableBuffer;

analysis::Ending failed(const std::exception& error, int code) {
  return {code, std::string("soda: ") + error.what() + "\n"};
}

std::string words(int argc, char** argv) {
  std::string text = "soda";
  for (int i = 1; i < argc; ++i) text += std::string(" ") + argv[i];
  return text;
}

analysis::Ending run(int argc, char** argv, kernel::Transport* transport) {
  try {
    PrintableBuffer to_out(std::cout.rdbuf()), to_err(std::cerr.rdbuf());
    std::ostream nowhere(nullptr), out(&to_out), err(&to_err);
    const bool speaks = transport == nullptr || transport->is_root();
    const int code = analysis::run_command_line(argc, argv, transport, speaks ? out : nowhere,
                                                speaks ? err : nowhere);
    if (!out.flush()) throw scenarios::FileError("standard output cannot be written");
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
  } catch (const analysis::OutOfMemory& error) {
    return failed(error, analysis::kExitFile);
  } catch (const std::bad_alloc&) {
    return {analysis::kExitFile, "soda: not enough memory for: " + words(argc, argv) + "\n"};
  } catch (const analysis::NumericalFailure& error) {
    return failed(error, analysis::kExitNumerical);
  } catch (const std::exception& error) {
    return failed(error, analysis::kExitInternal);
  }
}

// Large arrays come and go: what they lie in stays with the program, or each is faulted in anew.
void keep_memory() {
#ifdef __GLIBC__
  mallopt(M_MMAP_THRESHOLD, 32 << 20);  // the most that it takes
  mallopt(M_TRIM_THRESHOLD, 1 << 30);
#endif
}

}  // namespace

int main(int argc, char** argv) {
  keep_memory();
  std::signal(SIGXFSZ, SIG_IGN);  // a file that becomes too large is told like a full disk
  PrintableBuffer to_err(std::cerr.rdbuf());
  std::ostream err(&to_err);
  std::unique_ptr<kernel::Transport> transport;
  try {
    transport = analysis::join_job();
  } catch (const std::exception& error) {
    return analysis::end_job(nullptr, failed(error, analysis::kExitInput), err);
  }
  const analysis::Ending ending = run(argc, argv, transport.get());
  return analysis::end_job(transport.get(), ending, err);
}
