// SPDX-License-Identifier: Apache-2.0
#include "app/check/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <utility>

namespace tendril::app {
namespace {

constexpr auto kPatience = std::chrono::seconds(2);

}  // namespace

Progress::Progress(std::string what) : what_(std::move(what)) {}

Progress::~Progress() {
  if (shown_) fmt::print(stderr, "\r{:60}\r", "");
}

void Progress::show(double share) {
  if (std::chrono::steady_clock::now() < begin_ + kPatience || !::isatty(STDERR_FILENO)) return;
  shown_ = true;
  fmt::print(stderr, "\r{}: {:3.0f} %", what_, 100 * share);
  std::fflush(stderr);
}

}  // namespace tendril::app
