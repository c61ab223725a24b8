#include "analysis/commands/command_guide.hpp"

#include <CLI/CLI.hpp>
#include <sstream>
#include <vector>

namespace soda::analysis {
namespace {

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

std::vector<std::string> names_of(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  return names;
}

std::vector<const CLI::Option*> named_options(const CLI::App& command) {
  std::vector<const CLI::Option*> named;
  for (const CLI::Option* option : command.get_options())
    if (!names_of(*option).empty()) named.push_back(option);
  return named;
}

// Of an option that takes one of some words: these.
std::vector<std::string> values_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const std::size_t open = type.find('{'), close = type.find('}');
  std::vector<std::string> values;
  if (open == std::string::npos || close == std::string::npos) return values;
  for (std::size_t begin = open + 1; begin <= close;) {
    const std::size_t end = std::min(type.find(',', begin), close);
    values.push_back(type.substr(begin, end - begin));
    begin = end + 1;
  }
  return values;
}

std::string bash_script(const CLI::App& app) {
  std::string commands, options, values;
  for (const CLI::App* command : app.get_subcommands({})) {
    commands += (commands.empty() ? "" : " ") + command->get_name();
    std::vector<std::string> words;
    for (const CLI::Option* option : named_options(*command)) {
      const std::vector<std::string> names = names_of(*option);
      words.insert(words.end(), names.begin(), names.end());
      if (const std::vector<std::string> of = values_of(*option); !of.empty())
        values += "    '" + command->get_name() + " " + names.back() + "') words='" + joined(of) +
                  "' ;;\n";
    }
    options += "      " + command->get_name() + ") words='" + joined(words) + "' ;;\n";
  }
  return "_soda() {\n"
         "  local current=${COMP_WORDS[COMP_CWORD]} words=\n"
         "  case \"${COMP_WORDS[1]} ${COMP_WORDS[COMP_CWORD-1]}\" in\n" +
         values +
         "  esac\n"
         "  if ((COMP_CWORD == 1)); then\n"
         "    words='" +
         commands +
         "'\n"
         "  elif [[ -z $words && $current == -* ]]; then\n"
         "    case ${COMP_WORDS[1]} in\n" +
         options +
         "    esac\n"
         "  fi\n"
         "  COMPREPLY=($(compgen -W \"$words\" -- \"$current\"))\n"
         "}\n"
         "complete -o default -F _soda soda\n";
}

// A word for fish, in single quotes.
std::string fish_quoted(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text)
    quoted += c == '\'' || c == '\\' ? std::string("\\") + c : std::string(1, c);
  return quoted + "'";
}

std::string fish_script(const CLI::App& app) {
  std::string text;
  for (const CLI::App* command : app.get_subcommands({})) {
    text += "complete -c soda -n __fish_use_subcommand -f -a " + command->get_name() + " -d " +
            fish_quoted(command->get_description()) + "\n";
    for (const CLI::Option* option : named_options(*command)) {
      text += "complete -c soda -n '__fish_seen_subcommand_from " + command->get_name() + "'";
      for (const std::string& name : option->get_snames()) text += " -s " + name;
      for (const std::string& name : option->get_lnames()) text += " -l " + name;
      if (const std::vector<std::string> values = values_of(*option); !values.empty())
        text += " -x -a " + fish_quoted(joined(values));
      text += " -d " + fish_quoted(option->get_description()) + "\n";
    }
  }
  return text;
}

// Text as man(7) takes it: a line must not begin with a control character.
std::string roff(const std::string& text) {
  std::string result;
  bool begins = true;
  for (const char c : text) {
    if (begins && (c == '.' || c == '\'')) result += "\\&";
    if (c == '\\')
      result += "\\e";
    else if (c == '-')
      result += "\\-";
    else
      result += c;
    begins = c == '\n';
  }
  return result;
}

std::string roff_option(const CLI::Option& option) {
  std::string names;
  for (const std::string& name : names_of(option))
    names += (names.empty() ? "" : ", ") + ("\\fB" + roff(name) + "\\fR");
  if (names.empty()) names = "\\fI" + roff(option.get_name()) + "\\fR";
  if (option.get_items_expected_max() > 0 && !names_of(option).empty())
    names += " \\fI" + roff(option.get_type_name()) + "\\fR";
  return ".TP\n" + names + "\n" + roff(option.get_description()) + "\n";
}

std::string roff_command(const CLI::App& command) {
  std::string text =
      ".SS soda " + roff(command.get_name()) + "\n" + roff(command.get_description()) + ".\n";
  for (const CLI::Option* option : command.get_options()) text += roff_option(*option);
  const std::string footer = command.get_footer();
  if (!footer.empty()) text += ".PP\n.nf\n" + roff(footer) + "\n.fi\n";
  return text;
}

}  // namespace

// Zsh reads scripts for bash.
std::string completion_script(const CLI::App& app, const std::string& shell) {
  if (shell == "fish") return fish_script(app);
  const char* const begin = shell == "zsh" ? "autoload -U +X bashcompinit && bashcompinit\n" : "";
  return begin + bash_script(app);
}

std::string manual_page(const CLI::App& app, const std::string& version) {
  std::string text =
      ".TH SODA 1 \"\" \"soda " + version +
      "\" \"User Commands\"\n.SH NAME\nsoda \\- distributed, anticipative simulation "
      "of rigid bodies\n.SH SYNOPSIS\n.B soda\n\\fICOMMAND\\fR [\\fIARGUMENTS\\fR]\n"
      ".SH DESCRIPTION\n" +
      roff(app.get_description()) + "\n.SH COMMANDS\n";
  for (const CLI::App* command : app.get_subcommands({})) text += roff_command(*command);
  return text + ".SH NOTES\n" + roff(app.get_footer()) + "\n";
}

// Of a command's footer the lines that are set in.
std::string examples_of(const CLI::App& app, const std::string& command) {
  std::string text;
  for (const CLI::App* one : app.get_subcommands({})) {
    if (!command.empty() && one->get_name() != command) continue;
    text += (text.empty() ? "" : "\n") + one->get_description() + "\n";
    std::string line;
    for (std::istringstream lines(one->get_footer()); std::getline(lines, line);)
      if (line.starts_with("  ")) text += line + "\n";
  }
  return text;
}

}  // namespace soda::analysis
