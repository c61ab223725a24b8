#include "analysis/commands/command_guide.hpp"

#include <CLI/CLI.hpp>
#include <sstream>
#include <utility>

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

// What a command takes that is no option: of an argument that takes one of some words, these.
std::vector<std::string> argument_words(const CLI::App& command, const ArgumentWords& arguments) {
  std::vector<std::string> words;
  if (const auto known = arguments.find(command.get_name()); known != arguments.end())
    words = known->second;
  for (const CLI::Option* option : command.get_options()) {
    if (!names_of(*option).empty()) continue;
    const std::vector<std::string> values = values_of(*option);
    words.insert(words.end(), values.begin(), values.end());
  }
  return words;
}

std::string option_words(const CLI::App& command) {
  std::vector<std::string> words;
  for (const CLI::Option* option : named_options(command)) {
    const std::vector<std::string> names = names_of(*option);
    words.insert(words.end(), names.begin(), names.end());
  }
  return joined(words);
}

// A line of `case`.
std::string bash_case(const std::string& pattern, const std::string& words) {
  return "      " + pattern + ") words='" + words + "' ;;\n";
}

std::string bash_script(const CLI::App& app, const ArgumentWords& arguments) {
  std::string commands, options, values, others;
  for (const CLI::App* command : app.get_subcommands({})) {
    const std::string name = command->get_name();
    commands += (commands.empty() ? "" : " ") + name;
    options += bash_case(name, option_words(*command));
    for (const CLI::Option* option : named_options(*command))
      if (const std::vector<std::string> of = values_of(*option); !of.empty())
        values += bash_case("'" + name + " " + names_of(*option).back() + "'", joined(of));
    if (const std::vector<std::string> words = argument_words(*command, arguments); !words.empty())
      others += bash_case(name, joined(words));
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
         "    [[ $current == -* ]] && words='" +
         option_words(app) +
         "'\n"
         "  elif [[ -z $words && $current == -* ]]; then\n"
         "    case ${COMP_WORDS[1]} in\n" +
         options +
         "    esac\n"
         "  elif [[ -z $words ]]; then\n"
         "    case ${COMP_WORDS[1]} in\n" +
         others +
         "    esac\n"
         "  fi\n"
         "  COMPREPLY=($(compgen -W \"$words\" -- \"$current\"))\n"
         "}\n"
         "complete -o default -F _soda soda\n";
}

// Zsh runs functions for bash. Where it loads the script itself, from a folder of functions, the
// script is a function called _soda, which is to complete at once.
std::string zsh_script(const CLI::App& app, const ArgumentWords& arguments) {
  std::string script = bash_script(app, arguments);
  for (std::size_t at = 0; (at = script.find("_soda", at)) != std::string::npos; at += 11)
    script.replace(at, 5, "_soda_words");
  return "#compdef soda\nautoload -U +X bashcompinit && bashcompinit\n" + script +
         "[[ $funcstack[1] != _soda ]] || _bash_complete -o default -F _soda_words\n";
}

// A word for fish, in single quotes.
std::string fish_quoted(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text)
    quoted += c == '\'' || c == '\\' ? std::string("\\") + c : std::string(1, c);
  return quoted + "'";
}

// Its options.
std::string fish_options(const CLI::App& command, const std::string& condition) {
  std::string text;
  for (const CLI::Option* option : named_options(command)) {
    text += "complete -c soda -n " + condition;
    for (const std::string& name : option->get_snames()) text += " -s " + name;
    for (const std::string& name : option->get_lnames()) text += " -l " + name;
    if (const std::vector<std::string> values = values_of(*option); !values.empty())
      text += " -x -a " + fish_quoted(joined(values));
    text += " -d " + fish_quoted(option->get_description()) + "\n";
  }
  return text;
}

std::string fish_script(const CLI::App& app, const ArgumentWords& arguments) {
  std::string text = fish_options(app, "__fish_use_subcommand");
  for (const CLI::App* command : app.get_subcommands({})) {
    text += "complete -c soda -n __fish_use_subcommand -f -a " + command->get_name() + " -d " +
            fish_quoted(command->get_description()) + "\n";
    const std::string condition = "'__fish_seen_subcommand_from " + command->get_name() + "'";
    if (const std::vector<std::string> words = argument_words(*command, arguments); !words.empty())
      text += "complete -c soda -n " + condition +
              (arguments.contains(command->get_name()) ? "" : " -f") + " -a " +
              fish_quoted(joined(words)) + "\n";
    text += fish_options(*command, condition);
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

// What an option takes: its words, or a kind of value.
std::string value_of(const CLI::Option& option) {
  std::string text;
  for (const std::string& word : values_of(option)) text += (text.empty() ? "" : "|") + word;
  if (!text.empty()) return text;
  const std::string type = option.get_type_name();
  const std::string kind = type.substr(0, type.find(':'));
  return kind == "INT" || kind == "UINT" || kind == "FLOAT" ? "NUMBER" : kind;
}

// Where its numbers lie, if not anywhere: "INT:INT in [1 - 64]", "FLOAT:POSITIVE".
std::string range_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  if (type.ends_with(":POSITIVE")) return " (above 0)";
  if (type.ends_with(":NONNEGATIVE")) return " (at least 0)";
  const std::size_t open = type.find('['), dash = type.find(" - "), close = type.find(']');
  if (open == std::string::npos || dash == std::string::npos || close == std::string::npos)
    return "";
  return " (" + type.substr(open + 1, dash - open - 1) + " to " +
         type.substr(dash + 3, close - dash - 3) + ")";
}

std::string roff_option(const CLI::Option& option) {
  std::string names;
  for (const std::string& name : names_of(option))
    names += (names.empty() ? "" : ", ") + ("\\fB" + roff(name) + "\\fR");
  if (names.empty()) names = "\\fI" + roff(option.get_name()) + "\\fR";
  if (option.get_items_expected_max() > 0 && !names_of(option).empty())
    names += " \\fI" + roff(value_of(option)) + "\\fR";
  return ".TP\n" + names + "\n" + roff(option.get_description() + range_of(option)) + "\n";
}

std::string roff_command(const CLI::App& command) {
  std::string text =
      ".SS soda " + roff(command.get_name()) + "\n" + roff(command.get_description()) + ".\n";
  for (const CLI::Option* option : command.get_options()) text += roff_option(*option);
  const std::string footer = command.get_footer();
  if (!footer.empty()) text += ".PP\n.nf\n" + roff(footer) + "\n.fi\n";
  return text;
}

// As in docs/commands.md.
std::string roff_exit_codes() {
  constexpr std::pair<const char*, const char*> kCodes[] = {
      {"0", "ok"},
      {"1", "a check failed: runs differ, a log is damaged"},
      {"2", "usage or scenario"},
      {"3", "a file cannot be read or written, or is no log; memory does not suffice"},
      {"4", "a numerical fault was committed"},
      {"70", "a defect of soda"},
      {"130, 143", "SIGINT or SIGTERM ended the run early"},
  };
  std::string text = ".SH EXIT STATUS\n";
  for (const auto& [code, meaning] : kCodes)
    text += std::string(".TP\n\\fB") + code + "\\fR\n" + meaning + "\n";
  return text;
}

}  // namespace

std::string completion_script(const CLI::App& app, const std::string& shell,
                              const ArgumentWords& arguments) {
  if (shell == "fish") return fish_script(app, arguments);
  return shell == "zsh" ? zsh_script(app, arguments) : bash_script(app, arguments);
}

std::string manual_page(const CLI::App& app, const std::string& version) {
  std::string text =
      ".TH SODA 1 \"\" \"soda " + version +
      "\" \"User Commands\"\n.SH NAME\nsoda \\- distributed, anticipative simulation "
      "of rigid bodies\n.SH SYNOPSIS\n.B soda\n\\fICOMMAND\\fR [\\fIARGUMENTS\\fR]\n"
      ".SH DESCRIPTION\n" +
      roff(app.get_description()) + "\n.SH COMMANDS\n";
  for (const CLI::App* command : app.get_subcommands({})) text += roff_command(*command);
  return text + roff_exit_codes();
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
