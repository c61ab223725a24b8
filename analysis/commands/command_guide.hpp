// What the command line can do, for shells and for `man`: made from the options themselves.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace soda::analysis {

// Words that a command takes, by its name.
using ArgumentWords = std::map<std::string, std::vector<std::string>>;

// Each of `app`'s subcommands must have its options. `shell` is bash, zsh or fish. `arguments` are
// words beside those that the options themselves know.
std::string completion_script(const CLI::App& app, const std::string& shell,
                              const ArgumentWords& arguments);

// In the language of man(7).
std::string manual_page(const CLI::App& app, const std::string& version);

// What to try of each command, or of one of them.
std::string examples_of(const CLI::App& app, const std::string& command);

}  // namespace soda::analysis
