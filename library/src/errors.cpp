#include "soda/errors.hpp"

#include <utility>

namespace soda {

SceneError::SceneError(const std::string& message, std::vector<SceneFault> faults)
    : std::runtime_error(message), faults_(std::move(faults)) {}
SceneError::~SceneError() = default;

FileError::FileError(const std::string& message) : std::runtime_error(message) {}
FileError::~FileError() = default;

UsageError::UsageError(const std::string& message) : std::invalid_argument(message) {}
UsageError::~UsageError() = default;

NumericalError::NumericalError(std::int64_t step, std::uint32_t body, const std::string& what)
    : std::runtime_error("step " + std::to_string(step) + ", body " + std::to_string(body) + ": " +
                         what),
      step_(step),
      body_(body) {}
NumericalError::~NumericalError() = default;

}  // namespace soda
