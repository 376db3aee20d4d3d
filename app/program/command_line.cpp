// SPDX-License-Identifier: Apache-2.0
#include "app/program/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "app/program/command_line_pages.h"
#include "app/program/exit_codes.h"

namespace tendril::app {

using Argument = CommandLine::Argument;

namespace {

const CLI::Validator kNotEmpty(
    [](const std::string& text) { return std::string(text.empty() ? "must not be empty" : ""); }, "");

/// What is no number CLI11 refuses itself.
const CLI::Validator kFinite(
    [](const std::string& text) {
      const double number = std::strtod(text.c_str(), nullptr);
      return std::isfinite(number) ? std::string() : "must be a finite number, not " + text;
    },
    "");

}  // namespace

Argument& Argument::required() {
  option_.required();
  return *this;
}

Argument& Argument::not_negative() {
  option_.check(CLI::NonNegativeNumber);
  return *this;
}

Argument& Argument::within(int least, int greatest) {
  option_.check(CLI::Range(least, greatest));
  return *this;
}

Argument& Argument::within(double least, double greatest) {
  option_.check(CLI::Range(least, greatest));
  return *this;
}

Argument& Argument::one_of(const std::vector<std::string>& words) {
  option_.check(CLI::IsMember(words));
  return *this;
}

Argument& Argument::ending_in(const std::vector<std::string>& endings) {
  option_.check(CLI::Validator(
      [endings](const std::string& name) {
        const auto ends = [&name](const std::string& ending) { return name.ends_with(ending); };
        if (std::ranges::any_of(endings, ends)) return std::string();
        return "must end in " + CLI::detail::join(endings, " or ") + ", not be '" + name + "'";
      },
      ""));
  return *this;
}

Argument& Argument::repeatable() {
  option_.allow_extra_args(false);
  return *this;
}

Argument& Argument::separated_by_commas() {
  option_.delimiter(',');
  return *this;
}

Argument& Argument::excludes(const std::string& other) {
  option_.excludes(other);
  return *this;
}

Argument& Argument::needs(const std::string& other) {
  option_.needs(other);
  return *this;
}

CommandLine::CommandLine(const std::string& description)
    : owned_(std::make_unique<CLI::App>(description)), app_(*owned_) {
  app_.set_version_flag("--version", TENDRIL_VERSION);
}

CommandLine::CommandLine(CLI::App& command) : app_(command) {}

CommandLine::~CommandLine() = default;

Argument CommandLine::add(const std::string& name, std::string& value, const std::string& help) {
  return Argument(*app_.add_option(name, value, help)->check(kNotEmpty));
}

Argument CommandLine::add(const std::string& name, double& value, const std::string& help) {
  return Argument(*app_.add_option(name, value, help)->check(kFinite));
}

Argument CommandLine::add(const std::string& name, int& value, const std::string& help) {
  return Argument(*app_.add_option(name, value, help));
}

Argument CommandLine::add(const std::string& name, std::optional<double>& value, const std::string& help) {
  return Argument(*app_.add_option(name, value, help)->check(kFinite));
}

Argument CommandLine::add(const std::string& name, std::optional<int>& value, const std::string& help) {
  return Argument(*app_.add_option(name, value, help));
}

Argument CommandLine::add(const std::string& name, std::filesystem::path& value, const std::string& help) {
  return Argument(*app_.add_option(name, value, help));
}

Argument CommandLine::add(const std::string& name, std::vector<std::string>& value, const std::string& help) {
  return Argument(*app_.add_option(name, value, help));
}

Argument CommandLine::add(const std::string& name, std::vector<double>& value, const std::string& help) {
  return Argument(*app_.add_option(name, value, help)->check(kFinite));
}

Argument CommandLine::add_flag(const std::string& name, bool& value, const std::string& help) {
  return Argument(*app_.add_flag(name, value, help));
}

CommandLine& CommandLine::add_command(const std::string& name, const std::string& description) {
  app_.require_subcommand(1);
  commands_.push_back(std::unique_ptr<CommandLine>(new CommandLine(*app_.add_subcommand(name, description))));
  return *commands_.back();
}

bool CommandLine::given() const { return app_.parsed(); }

std::optional<int> CommandLine::parse(int argc, const char* const* argv) {
  const std::string first = argc > 1 ? argv[1] : "", program = std::filesystem::path(argv[0]).filename();
  if (first == "--print-man-page" || (first == "--print-completion" && argc > 2)) {
    fmt::print("{}",
               first == "--print-man-page" ? man_page(app_, program) : completion(app_, program, argv[2]));
    return kOk;
  }
  try {
    app_.parse(argc, argv);
    return std::nullopt;
  } catch (const CLI::ParseError& error) {
    return app_.exit(error) == 0 ? kOk : kUsage;  // CLI11's own codes are many, ours are four
  }
}

}  // namespace tendril::app
