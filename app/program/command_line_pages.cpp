// SPDX-License-Identifier: Apache-2.0
#include "app/program/command_line_pages.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <sstream>
#include <vector>

namespace tendril::app {
namespace {

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += by.size())
    text.replace(at, what.size(), by);
  return text;
}

/// A text as roff takes it: its lines stay lines, none is a request, and a dash stays a dash.
std::string roff(const std::string& text) {
  std::istringstream lines(replaced(replaced(text, "\\", "\\e"), "-", "\\-"));
  std::string result;
  for (std::string line; std::getline(lines, line);) {
    if (!result.empty()) result += line.empty() ? "\n.PP" : result.ends_with(".PP") ? "\n" : "\n.br\n";
    if (line.starts_with('.') || line.starts_with('\'')) result += "\\&";
    result += line;
  }
  return result;
}

std::string one_line(const std::string& text) { return text.substr(0, text.find_first_of(";.\n")); }

/// Options that have a name with dashes, and arguments that have none.
std::vector<const CLI::Option*> options_of(const CLI::App& app, bool positional) {
  std::vector<const CLI::Option*> result;
  for (const CLI::Option* option : app.get_options())
    if (option->get_positional() == positional && !option->get_group().empty()) result.push_back(option);
  return result;
}

bool takes_value(const CLI::Option& option) { return option.get_items_expected_max() > 0; }

std::string man_options(const CLI::App& app) {
  std::string text;
  for (const bool positional : {true, false})
    for (const CLI::Option* option : options_of(app, positional))
      text += fmt::format(".TP\n\\fB{}\\fR{}\n{}\n", roff(option->get_name(positional)),
                          !positional && takes_value(*option) ? " \\fIVALUE\\fR" : "",
                          roff(option->get_description()));
  return text;
}

std::string synopsis(const CLI::App& app, const std::string& name) {
  std::string line = "\\fB" + roff(name) + "\\fR [\\fIOPTIONS\\fR]";
  for (const CLI::Option* option : options_of(app, true))
    line += option->get_required() ? " \\fI" + option->get_name(true) + "\\fR"
                                   : " [\\fI" + option->get_name(true) + "\\fR]";
  return line + "\n.br\n";
}

std::vector<const CLI::App*> commands_of(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App*) { return true; });
}

std::vector<std::string> words_of(const CLI::App& app) {
  std::vector<std::string> words;
  for (const CLI::Option* option : options_of(app, false))
    for (const std::string& name : option->get_lnames()) words.push_back("--" + name);
  return words;
}

std::string bash(const CLI::App& app, const std::string& program) {
  const std::string function = "_" + replaced(program, "-", "_");
  const auto commands = commands_of(app);
  std::string text =
      fmt::format("# Completes {0} in bash.\n{1}() {{\n  local word=${{COMP_WORDS[COMP_CWORD]}} list\n",
                  program, function);
  std::vector<std::string> first;
  for (const CLI::App* command : commands) first.push_back(command->get_name());
  const std::vector<std::string> general = words_of(app);
  text += "  case ${COMP_WORDS[1]} in\n";
  for (const CLI::App* command : commands)
    text += fmt::format("    {}) list='{}' ;;\n", command->get_name(), fmt::join(words_of(*command), " "));
  text += fmt::format("    *) list='{}' ;;\n  esac\n", fmt::join(general, " "));
  if (!commands.empty())
    text += fmt::format("  if ((COMP_CWORD == 1)); then list='{} {}'; fi\n", fmt::join(first, " "),
                        fmt::join(general, " "));
  text += fmt::format(
      "  if [[ $word == -*{} ]]; then\n    mapfile -t COMPREPLY < <(compgen -W \"$list\" -- \"$word\")\n  "
      "else\n"
      "    mapfile -t COMPREPLY < <(compgen -f -- \"$word\")\n  fi\n}}\ncomplete -o filenames -F {} {}\n",
      commands.empty() ? "" : " || $COMP_CWORD == 1", function, program);
  return text;
}

std::string zsh_arguments(const CLI::App& app) {
  std::string text = "_arguments";
  for (const CLI::Option* option : options_of(app, false))
    for (const std::string& name : option->get_lnames()) {
      std::string help = replaced(one_line(option->get_description()), "'", "'\\''");
      for (const char* special : {"[", "]", ":"}) help = replaced(help, special, std::string("\\") + special);
      text += fmt::format(" '--{}[{}]{}'", name, help, takes_value(*option) ? ":value:_files" : "");
    }
  return text + " '*:file:_files'";
}

std::string zsh(const CLI::App& app, const std::string& program) {
  const auto commands = commands_of(app);
  std::string text = fmt::format("#compdef {}\n", program);
  if (commands.empty()) return text + zsh_arguments(app) + "\n";
  text += "if ((CURRENT == 2)); then\n  local -a commands=(";
  for (const CLI::App* command : commands)
    text += fmt::format("\n    '{}:{}'", command->get_name(),
                        replaced(one_line(command->get_description()), "'", "'\\''"));
  text += "\n  )\n  _describe command commands\n  return\nfi\ncase $words[2] in\n";
  for (const CLI::App* command : commands)
    text += fmt::format("  {}) {} ;;\n", command->get_name(), zsh_arguments(*command));
  return text + "esac\n";
}

std::string fish_options(const CLI::App& app, const std::string& program, const std::string& condition) {
  std::string text;
  for (const CLI::Option* option : options_of(app, false))
    for (const std::string& name : option->get_lnames())
      text += fmt::format("complete -c {}{} -l {}{} -d '{}'\n", program, condition, name,
                          takes_value(*option) ? " -r" : "",
                          replaced(one_line(option->get_description()), "'", "\\'"));
  return text;
}

std::string fish(const CLI::App& app, const std::string& program) {
  const auto commands = commands_of(app);
  std::string text = fish_options(app, program, commands.empty() ? "" : " -n __fish_use_subcommand");
  for (const CLI::App* command : commands) {
    text += fmt::format("complete -c {} -f -n __fish_use_subcommand -a {} -d '{}'\n", program,
                        command->get_name(), replaced(one_line(command->get_description()), "'", "\\'"));
    text += fish_options(*command, program,
                         fmt::format(" -n '__fish_seen_subcommand_from {}'", command->get_name()));
  }
  return text;
}

}  // namespace

std::string man_page(const CLI::App& app, const std::string& program) {
  const std::string about = app.get_description();
  std::string text = fmt::format(".TH {} 1 \"\" \"Tendril {}\"\n.SH NAME\n{} \\- {}\n.SH SYNOPSIS\n", program,
                                 TENDRIL_VERSION, roff(program), roff(one_line(about)));
  const auto commands = commands_of(app);
  if (commands.empty()) text += synopsis(app, program);
  for (const CLI::App* command : commands) text += synopsis(*command, program + " " + command->get_name());
  text += fmt::format(".SH DESCRIPTION\n{}\n.SH OPTIONS\n{}", roff(about), man_options(app));
  if (!commands.empty()) text += ".SH COMMANDS\n";
  for (const CLI::App* command : commands)
    text += fmt::format(".SS {}\n{}\n{}", roff(command->get_name()), roff(command->get_description()),
                        man_options(*command));
  return text;
}

std::string completion(const CLI::App& app, const std::string& program, const std::string& shell) {
  if (shell == "bash") return bash(app, program);
  if (shell == "zsh") return zsh(app, program);
  return shell == "fish" ? fish(app, program) : "";
}

}  // namespace tendril::app
