// SPDX-License-Identifier: Apache-2.0
#include "tests/app/plant/faults.h"

#include <catch2/catch.hpp>
#include <chrono>
#include <thread>

#include "hal/bus/open_bus.h"

namespace tendril::app {

void require_running(Process& daemon, Workbench& bench) {
  const bool running = daemon.says("phase: run");
  INFO(daemon.err() << bench.plant().err());
  REQUIRE(running);
}

void check_stops(Workbench& bench, const Faults& faults) {
  for (const auto& [line, reason] : faults) {
    CAPTURE(line);
    Process daemon(bench.daemon());
    require_running(daemon, bench);
    bench.plant().write_line(line);
    CHECK(daemon.wait() == 1);
    INFO(daemon.err() << bench.plant().err());
    const std::string::size_type stopped = daemon.err().find("stopped: ");
    REQUIRE(stopped != std::string::npos);
    CHECK(daemon.err().find(reason, stopped) != std::string::npos);
    bench.plant().write_line("clear");
  }
}

Ear::Ear(const std::string& bus, const std::vector<uint32_t>& wanted)
    : bus_(hal::open_bus(bus, hal::BusRole::kJoin, wanted)) {}

bool Ear::hears(std::vector<Question> questions) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(kPatience_s);
  while (!questions.empty() && std::chrono::steady_clock::now() < deadline) {
    for (hal::Frame frame; bus_->receive(frame);) {
      last_ = hal::to_text(frame);
      std::erase_if(questions, [&](const Question& question) { return question(frame); });
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  if (!questions.empty())
    UNSCOPED_INFO(questions.size() << " of the frames waited for did not come; the last one was '" << last_
                                   << "'");
  return questions.empty();
}

}  // namespace tendril::app
