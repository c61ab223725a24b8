// What the command line can do, for shells and for `man`: made from the options themselves.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace soda::analysis {

// Each of `app`'s subcommands must have its options. `shell` is bash, zsh or fish.
std::string completion_script(const CLI::App& app, const std::string& shell);

// In the language of man(7).
std::string manual_page(const CLI::App& app, const std::string& version);

// What to try of each command, or of one of them.
std::string examples_of(const CLI::App& app, const std::string& command);

}  // namespace soda::analysis
