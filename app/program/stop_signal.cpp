// SPDX-License-Identifier: Apache-2.0
#include "app/program/stop_signal.h"

#include <pthread.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <ctime>

namespace tendril::app {
namespace {

constexpr auto kLookForSignal = std::chrono::milliseconds(10);

std::atomic<int> signals{0};
sigset_t watched = [] {
  sigset_t none;
  sigemptyset(&none);
  return none;
}();

}  // namespace

void watch_stop_signals() {
  for (const int signal : {SIGTERM, SIGINT, SIGHUP}) {
    struct sigaction before {};
    sigaction(signal, nullptr, &before);
    if (before.sa_handler != SIG_IGN) sigaddset(&watched, signal);
  }
  pthread_sigmask(SIG_BLOCK, &watched, nullptr);
  struct sigaction ignore {};
  ignore.sa_handler = SIG_IGN;
  sigaction(SIGPIPE, &ignore, nullptr);
}

bool stop_signalled() noexcept { return stop_signals() > 0; }

int stop_signals() noexcept {
  constexpr timespec kAtOnce{0, 0};
  while (sigtimedwait(&watched, nullptr, &kAtOnce) > 0) signals.fetch_add(1, std::memory_order_relaxed);
  return signals.load(std::memory_order_relaxed);
}

void take_signals_as_usual(posix_spawnattr_t& attributes) {
  sigset_t none, usual;
  sigemptyset(&none);
  sigemptyset(&usual);
  for (const int signal : {SIGTERM, SIGINT, SIGHUP, SIGPIPE})
    if (signal == SIGPIPE || sigismember(&watched, signal)) sigaddset(&usual, signal);
  short flags = 0;
  posix_spawnattr_getflags(&attributes, &flags);
  posix_spawnattr_setflags(&attributes,
                           static_cast<short>(flags | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF));
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &usual);
}

ExitOnStopSignal::ExitOnStopSignal()
    : thread_([this] {
        while (!quit_) {
          if (stop_signalled()) {
            spdlog::info("stopped while starting; no drive was touched");
            std::_Exit(0);
          }
          std::this_thread::sleep_for(kLookForSignal);
        }
      }) {}

ExitOnStopSignal::~ExitOnStopSignal() {
  quit_ = true;
  thread_.join();
}

}  // namespace tendril::app
