#include "analysis/commands/line_editor.hpp"

#include <dlfcn.h>
#include <unistd.h>

#include <iostream>
#include <utility>

#include "analysis/process/installed.hpp"

namespace soda::analysis {
namespace {

class PlainLines final : public LineEditor {
 public:
  PlainLines(std::string prompt, bool on_terminal)
      : prompt_(std::move(prompt)), on_terminal_(on_terminal) {}

  std::optional<std::string> next() override {
    if (on_terminal_) std::cout << prompt_ << std::flush;
    std::string line;
    if (!std::getline(std::cin, line)) return std::nullopt;
    return line;
  }
  bool is_on_terminal() const override { return on_terminal_; }

 private:
  const std::string prompt_;
  const bool on_terminal_;
};

// Null where soda was built without it.
EditLines* editing_of_module() {
  void* const library = dlopen(module_file("soda_lines.so").c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) return nullptr;
  return reinterpret_cast<EditLines*>(dlsym(library, kEditLinesSymbol));
}

}  // namespace

std::unique_ptr<LineEditor> edit_lines(const std::string& prompt, Completions completions) {
  const bool on_terminal = isatty(STDIN_FILENO) == 1 && isatty(STDOUT_FILENO) == 1;
  EditLines* const edit = on_terminal ? editing_of_module() : nullptr;
  if (edit != nullptr) return std::unique_ptr<LineEditor>(edit(prompt, std::move(completions)));
  return std::make_unique<PlainLines>(prompt, on_terminal);
}

}  // namespace soda::analysis
