// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace tendril::app {

/// The arguments of a program: declared one by one, explained by --help, and parsed. --version is among them.
/// CLI11 does it. Its headers take longer to compile than our programs, so one source file includes them.
/// Real-time: no.
class CommandLine {
 public:
  /// An argument that was declared, for what else holds for it.
  class Argument {
   public:
    explicit Argument(CLI::Option& option) : option_(option) {}
    Argument& required();
    Argument& not_negative();
    Argument& within(int least, int greatest);
    Argument& within(double least, double greatest);
    Argument& one_of(const std::vector<std::string>& words);
    /// Of a file's name.
    Argument& ending_in(const std::vector<std::string>& endings);
    /// One value each time that the option is given.
    Argument& repeatable();
    /// Several values at once, parted by commas.
    Argument& separated_by_commas();
    Argument& excludes(const std::string& other);
    /// It is given only beside the other one, which has been declared before.
    Argument& needs(const std::string& other);

   private:
    CLI::Option& option_;
  };

  /// @param description  the head of --help
  explicit CommandLine(const std::string& description);
  ~CommandLine();
  CommandLine(const CommandLine&) = delete;
  CommandLine& operator=(const CommandLine&) = delete;

  /// Declares an option ("--rate") or, without dashes, an argument that is told from others by its place. A
  /// text must not be empty, a number must be finite.
  /// @param value  what is given is written there, during parse()
  Argument add(const std::string& name, std::string& value, const std::string& help);
  Argument add(const std::string& name, double& value, const std::string& help);
  Argument add(const std::string& name, int& value, const std::string& help);
  Argument add(const std::string& name, std::optional<double>& value, const std::string& help);
  Argument add(const std::string& name, std::optional<int>& value, const std::string& help);
  Argument add(const std::string& name, std::filesystem::path& value, const std::string& help);
  Argument add(const std::string& name, std::vector<std::string>& value, const std::string& help);
  Argument add(const std::string& name, std::vector<double>& value, const std::string& help);
  /// Declares an option without a value: true where it is given.
  Argument add_flag(const std::string& name, bool& value, const std::string& help);

  /// Declares a command, one of which must then be given, with arguments of its own.
  CommandLine& add_command(const std::string& name, const std::string& description);

  /// Whether this command was given, after parse().
  bool given() const;

  /// @return  the exit code where the program shall end at once: after --help, --version and, for those who
  /// package
  ///          it, --print-man-page and --print-completion SHELL; and for wrong usage, which has been
  ///          explained on stderr by then
  std::optional<int> parse(int argc, const char* const* argv);

 private:
  explicit CommandLine(CLI::App& command);

  std::unique_ptr<CLI::App> owned_;  // empty in a command
  CLI::App& app_;
  std::vector<std::unique_ptr<CommandLine>> commands_;
};

}  // namespace tendril::app
