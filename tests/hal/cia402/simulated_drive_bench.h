// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "hal/cia402/cia402_setup.h"
#include "hal/cia402/simulated_cia402_drive.h"
#include "tests/hal/rig.h"

namespace tendril::hal::test {

using Texts = std::vector<std::string>;

/// A drive, node 2, that is talked to frame by frame.
struct Bench {
  explicit Bench(SimulatedCia402Spec spec = {.node = 2, .top_speed = 1e6, .position_counts = 500})
      : drive(spec) {}

  /// What the drive answers to a frame, as text.
  std::vector<std::string> say(const std::string& text) {
    FrameBatch out;
    drive.receive(*parse_frame(text), now_ns, out);
    return texts(out);
  }

  std::vector<std::string> advance(int64_t duration_ns) {
    FrameBatch out;
    now_ns += duration_ns;
    drive.advance(now_ns, out);
    return texts(out);
  }

  /// The answer to an SDO request: "60...", "4F..." or "80...".
  std::string sdo(const std::string& bytes) {
    const auto answers = say("602#" + bytes);
    return answers.size() == 1 ? answers[0].substr(4) : "no answer";
  }

  /// Everything a master sets up but the consumer heartbeat, then NMT start.
  void set_up() {
    advance(0);
    MasterConfig config = config_of(2);
    for (const SdoStep& step : setup_steps(config.axes[1], config)) {
      if (step.request.object.index == 0x1016) continue;
      const auto answers = say(to_text(encode_sdo_request(2, step.request)));
      REQUIRE(answers.size() >= 1);
      REQUIRE(decode_sdo_answer(*parse_frame(answers.back()), 2)->kind != SdoAnswer::Kind::kAbort);
    }
    say("000#0102");
  }

  /// One period: RPDO, SYNC, time. @return the answers to SYNC
  std::vector<std::string> cycle(uint16_t word, int32_t target) {
    say(to_text(encode_drive_command(0x202, {word, target})));
    auto answers = say("080#");
    advance(kPeriod_ns);
    return answers;
  }

  void enable() {
    for (const uint16_t word : std::initializer_list<uint16_t>{0x06, 0x07, 0x0F})
      cycle(word, static_cast<int32_t>(drive.position()));
    REQUIRE(drive.state() == DriveState::kEnabled);
  }

  static std::vector<std::string> texts(const FrameBatch& batch) {
    std::vector<std::string> list;
    for (const Frame& frame : batch) list.push_back(to_text(frame));
    return list;
  }

  SimulatedCia402Drive drive;
  int64_t now_ns = 0;
};

}  // namespace tendril::hal::test
