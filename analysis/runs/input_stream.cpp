#include "analysis/runs/input_stream.hpp"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <ostream>

#include "analysis/text/exit_codes.hpp"
#include "scenarios/read_scenario.hpp"

namespace soda::analysis {

InputStream::InputStream(int descriptor, std::string name, const scenarios::Scenario& scenario,
                         std::ostream& err)
    : descriptor_(descriptor), err_(err), lines_(scenario, std::move(name)) {}

InputStream::~InputStream() {
  stop();
  if (descriptor_ != STDIN_FILENO) close(descriptor_);
}

void InputStream::start() {
  reader_ = std::jthread([this](const std::stop_token& stop) { read(stop); });
}

std::size_t InputStream::stop() {
  if (reader_.joinable()) {
    reader_.request_stop();
    reader_.join();
  }
  return bad_lines_;
}

// A read may wait for ever, so it is asked for only when there is something, or the end.
void InputStream::read(const std::stop_token& stop) {
  constexpr int kLongest_ms = 20;
  constexpr std::size_t kLongestLine = std::size_t{1} << 20;
  std::string rest;
  std::array<char, 4096> buffer;
  while (!stop.stop_requested()) {
    pollfd ready{descriptor_, POLLIN, 0};
    if (poll(&ready, 1, kLongest_ms) <= 0) continue;
    const ssize_t count = ::read(descriptor_, buffer.data(), buffer.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) break;
    rest.append(buffer.data(), static_cast<std::size_t>(count));
    std::size_t begin = 0;
    for (std::size_t end; (end = rest.find('\n', begin)) != std::string::npos; begin = end + 1)
      take(std::string_view(rest).substr(begin, end - begin));
    rest.erase(0, begin);
    if (rest.size() > kLongestLine) {
      refuse("a line of more than 1 MiB; nothing more is read");
      return;
    }
  }
  take(rest);
}

void InputStream::take(std::string_view line) {
  try {
    if (const auto input = lines_.read(line)) inputs_.offer(*input);
  } catch (const scenarios::InputError& error) {
    refuse(error.what());
  }
}

void InputStream::refuse(const std::string& what) {
  ++bad_lines_;
  err_ << "soda: " + what + "\n" << std::flush;
}

std::unique_ptr<InputStream> open_inputs(const std::string& from, scenarios::Scenario& scenario,
                                         std::ostream& err) {
  if (from.empty()) return nullptr;
  if (from != "-" && std::filesystem::is_regular_file(from)) {
    scenarios::InputLines lines(scenario, from);
    for (const models::UserInput& input : lines.read_all(scenarios::read_text(from))) {
      if (input.step < scenario.run.first_step)
        throw UsageError("--inputs: " + from + ": input " + std::to_string(input.id) +
                         " is for step " + std::to_string(input.step) +
                         "; the run goes on from step " + std::to_string(scenario.run.first_step));
      scenario.run.inputs.script.push_back(input);
    }
    return nullptr;
  }
  const int descriptor = from == "-" ? STDIN_FILENO : open(from.c_str(), O_RDONLY | O_NONBLOCK);
  if (descriptor < 0)
    throw scenarios::FileError(from + ": cannot be opened: " + std::strerror(errno));
  auto stream = std::make_unique<InputStream>(descriptor, from == "-" ? "standard input" : from,
                                              scenario, err);
  scenario.run.inputs.live = &stream->inputs();
  return stream;
}

}  // namespace soda::analysis
