// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cstring>
#include <exception>
#include <iostream>

#include "tests/validation/cases.h"

// Runs validation cases and prints what they measure as JSON lines; tools/validate makes a page of them.

namespace {

constexpr const char* kUsage =
    "usage: validate [--short] CASE | validate --list\n\n"
    "Runs one validation case and prints what it measures, one JSON object a line. tools/validate runs them "
    "all.\n"
    "  --short  coarser meshes: what the tests run\n"
    "  --list   prints the names of the cases\n"
    "Exit codes: 0 all figures within their limits; 1 one is not, or a body did not come to rest; 2 wrong "
    "usage.\n";

int run(const tendril::validation::Case& chosen, tendril::validation::Extent extent) {
  tendril::validation::Report report(&std::cout);
  report.begin_case(chosen.name, chosen.title);
  chosen.run(report, extent);
  for (const auto& row : report.rows())
    if (!row.passed()) return 1;
  return 0;
}

}  // namespace

int main(int argc, char** argv) try {
  using namespace tendril::validation;
  Extent extent = Extent::kFull;
  const Case* chosen = nullptr;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument == "--help" || argument == "-h") {
      std::cout << kUsage;
      return 0;
    }
    if (argument == "--list") {
      for (const Case& one : cases()) std::cout << one.name << '\n';
      return 0;
    }
    if (argument == "--short") extent = Extent::kShort;
    for (const Case& one : cases())
      if (argument == one.name) chosen = &one;
  }
  if (!chosen) {
    std::cerr << kUsage;
    return 2;
  }
  return run(*chosen, extent);
} catch (const std::exception& error) {
  std::cerr << fmt::format("validate: {}\n", error.what());
  return 1;
}
