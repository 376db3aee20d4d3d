// SPDX-License-Identifier: Apache-2.0
#include "hal/drive/frame_layout.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <set>

#include "hal/canopen/canopen.h"
#include "hal/canopen/emergency.h"
#include "hal/canopen/sdo.h"
#include "hal/cia402/cia402.h"
#include "hal/drive/drive_protocol.h"
#include "hal/odrive/odrive.h"
#include "tests/hal/rig.h"

namespace tendril::hal::frame_layout_test {
using namespace tendril::hal::test;

/// The table of a robot's frames, to be held against the codecs.
class Layouts {
 public:
  explicit Layouts(MasterConfig config) : config_(std::move(config)) {
    config_.sensors = {camera(0x7F5)};
    config_.protocol->check(config_);
    frames_ = frame_layouts(config_, std::vector<DisplacementUnit>(config_.axes.size()));
  }

  const std::vector<FrameLayout>& frames() const { return frames_; }

  /// A signal of a frame that a codec made, which must be of the length in the table.
  double value(const Frame& frame, const std::string& name) const {
    INFO(to_text(frame) << " " << name);
    const FrameLayout* layout = find(frame);
    REQUIRE(layout != nullptr);
    CHECK(layout->length == frame.length);
    for (const Signal& signal : layout->signals)
      if (signal.name == name) return decode(signal, frame).value();
    FAIL("no such signal");
    return 0;
  }

  const FrameLayout* find(const Frame& frame) const {
    const auto found = std::find_if(frames_.begin(), frames_.end(),
                                    [&](const FrameLayout& layout) { return layout.id == frame.id; });
    return found == frames_.end() ? nullptr : &*found;
  }

 private:
  MasterConfig config_;
  std::vector<FrameLayout> frames_;
};

/// Runs drives through start, motion, a fault and their farewell. @return all that was said on the bus
template <class AnyRig>
std::vector<Frame> everything_said(AnyRig& rig) {
  const auto cycles = [&rig](int count) {
    for (int i = 0; i < count; ++i) rig.cycle();
  };
  cycles(300);
  rig.command.enable = true;
  cycles(200);
  rig.drives[0].overheat();
  cycles(100);
  rig.command.reset = true;
  cycles(400);
  rig.command.enable = false;
  rig.command.finish = true;
  cycles(200);
  return rig.traffic;
}

template <class AnyRig>
void check_traffic(const MasterConfig& config) {
  AnyRig rig(config);
  const Layouts layouts(config);
  std::set<uint32_t> heard;
  for (const Frame& frame : everything_said(rig)) {
    heard.insert(frame.id);
    const FrameLayout* layout = layouts.find(frame);
    if (layout == nullptr || layout->length != frame.length) FAIL(to_text(frame) << " is not in the table");
  }
  CHECK(heard.size() > config.axes.size() * 3);
}

TEST_CASE("The table of frames reads what the CANopen codecs write", "[unit]") {
  const Layouts layouts(config_of(2));
  const double mm = 62.8 / 65536;
  const Frame command = encode_drive_command(0x201, {0x0F, 10000});
  CHECK(layouts.value(command, "controlword") == 0x0F);
  CHECK(layouts.value(command, "target_position") == Approx(10000 * mm));
  const Frame feedback = encode_drive_feedback(0x182, {0x1237, -70000});  // of the reversed axis
  CHECK(layouts.value(feedback, "statusword") == 0x1237);
  CHECK(layouts.value(feedback, "actual_position") == Approx(70000 * mm));
  const Frame emergency = encode_emergency(1, {0x8130, 0x11, {1, 2, 3, 4, 5}});
  CHECK(layouts.value(emergency, "error_code") == 0x8130);
  CHECK(layouts.value(emergency, "error_register") == 0x11);
  CHECK(layouts.value(emergency, "detail") == 0x05'0403'0201);
  const Frame request = encode_sdo_request(2, {SdoRequest::Kind::kWrite, {0x60C2, 1}, 4, 0x89ABCDEF});
  CHECK(layouts.value(request, "command") == 0x23);
  CHECK(layouts.value(request, "index") == 0x60C2);
  CHECK(layouts.value(request, "subindex") == 1);
  CHECK(layouts.value(request, "data") == 0x89ABCDEF);
  CHECK(layouts.value(encode_sdo_answer(2, {SdoAnswer::Kind::kValue, {0x6061, 0}, 1, 8}), "data") == 8);
  CHECK(layouts.value(encode_heartbeat(127, NmtState::kOperational), "nmt_state") == 5);
  CHECK(layouts.value(encode_heartbeat(2, NmtState::kPreOperational), "nmt_state") == 0x7F);
  CHECK(layouts.value(encode_nmt({NmtCommand::kResetNode, 2}), "command") == 0x81);
  CHECK(layouts.value(encode_nmt({NmtCommand::kResetNode, 2}), "node") == 2);
  CHECK(layouts.find(encode_sync())->length == 0);
}

TEST_CASE("The table of frames reads torques in Nm", "[unit]") {
  MasterConfig canopen = on_efforts(config_of(2), 1, 10e-3);
  cia402_settings(canopen.axes[0]).rated_torque = 0.5;
  const Layouts layouts(canopen), odrive(on_efforts(odrive_config_of(2), 1, 10e-3));
  CHECK(layouts.value(encode_torque_command(0x201, {0x0F, -300}), "target_torque") == Approx(-0.15));
  CHECK(layouts.value(encode_drive_command(0x202, {0x0F, 0}), "target_position") == 0);
  CHECK(odrive.value(encode_odrive_torque(0, 0.25f), "target_torque") == 0.25);
  check_traffic<Rig>(canopen);
  check_traffic<OdriveRig>(on_efforts(odrive_config_of(2), 1, 10e-3));
}

TEST_CASE("The table of frames knows where a drive's zero lies", "[unit]") {
  MasterConfig canopen = config_of(1), odrive = odrive_config_of(1);
  canopen.axes[0].scale.offset = odrive.axes[0].scale.offset = 2e-3;
  CHECK(Layouts(canopen).value(encode_drive_feedback(0x181, {0x1237, 0}), "actual_position") == Approx(2));
  CHECK(Layouts(odrive).value(encode_odrive_estimates(0, {0, 0}), "position") == Approx(2));
}

TEST_CASE("The table of frames reads what the ODrive codecs write", "[unit]") {
  for (const OdriveFirmware firmware : {OdriveFirmware::k0_5, OdriveFirmware::k0_6}) {
    const Layouts layouts(odrive_config_of(2, firmware));
    const Frame heartbeat = encode_odrive_heartbeat(1, firmware,
                                                    {.axis_error = 0x1000001,
                                                     .state = 8,
                                                     .component_errors = 5,
                                                     .procedure_result = 3,
                                                     .trajectory_done = true});
    CHECK(layouts.value(heartbeat, "axis_error") == 0x1000001);
    CHECK(layouts.value(heartbeat, "axis_state") == 8);
    CHECK(layouts.value(heartbeat, "trajectory_done") == 1);
    if (firmware == OdriveFirmware::k0_6) {
      CHECK(layouts.value(heartbeat, "procedure_result") == 3);
      const Frame version = encode_odrive_version(1, {2, {4, 3, 58}, {0, 6, 9, 1}});
      const double told[] = {2, 4, 3, 58, 0, 6, 9, 1};
      const char* names[] = {"protocol",       "hardware_major", "hardware_minor",    "hardware_variant",
                             "firmware_major", "firmware_minor", "firmware_revision", "firmware_unreleased"};
      for (int i = 0; i < 8; ++i) CHECK(layouts.value(version, names[i]) == told[i]);
      CHECK(layouts.value(encode_odrive_error(1, 0x100, 0x200), "active_errors") == 0x100);
      CHECK(layouts.value(encode_odrive_error(1, 0x100, 0x200), "disarm_reason") == 0x200);
      CHECK(layouts.value(encode_odrive_temperature(1, 40, 50), "power_stage") == 40);
      CHECK(layouts.value(encode_odrive_temperature(1, 40, 50), "motor") == 50);
    } else {
      CHECK(layouts.value(heartbeat, "motor_error") == 1);
      CHECK(layouts.value(heartbeat, "encoder_error") == 0);
      CHECK(layouts.value(heartbeat, "controller_error") == 1);
    }
    const Frame estimates = encode_odrive_estimates(0, {0.5f, -2});
    CHECK(layouts.value(estimates, "position") == Approx(31.4));
    CHECK(layouts.value(estimates, "velocity") == Approx(-125.6));
    const Frame input = encode_odrive_input(0, {0.25f, 1.5f, -0.125f});
    CHECK(layouts.value(input, "target_position") == Approx(15.7));
    CHECK(layouts.value(input, "velocity") == Approx(94.2));
    CHECK(layouts.value(input, "torque") == Approx(-0.125));
    CHECK(layouts.value(encode_odrive_state(1, 8), "requested_state") == 8);
    CHECK(layouts.value(encode_odrive_mode(1, {3, 1}), "control_mode") == 3);
    CHECK(layouts.value(encode_odrive_mode(1, {3, 1}), "input_mode") == 1);
    CHECK(layouts.value(encode_odrive_limits(1, {20, 15}), "velocity_limit") == 20);
    CHECK(layouts.value(encode_odrive_limits(1, {20, 15}), "current_limit") == 15);
    CHECK(layouts.value(encode_odrive_iq(1, 3, 2), "set_point") == 3);
    CHECK(layouts.value(encode_odrive_iq(1, 3, 2), "measured") == 2);
    CHECK(layouts.value(encode_odrive_supply(1, 24, -1.5f), "voltage") == 24);
    CHECK(layouts.value(encode_odrive_supply(1, 24, -1.5f), "current") == -1.5);
    CHECK(layouts.find(encode_odrive_clear_errors(1))->length == 0);
  }
}

TEST_CASE("The table of frames reads what sensors write, in the units that people read", "[unit]") {
  const Layouts layouts(config_of(1));
  const double seen[] = {0.01, -0.02, 0.125};
  const auto frame = encode_sample(camera(0x7F5), seen, 2'500'000);
  CHECK(layouts.value(*frame, "tip_x") == Approx(10));
  CHECK(layouts.value(*frame, "tip_y") == Approx(-20));
  CHECK(layouts.value(*frame, "tip_z") == Approx(125));
  CHECK(layouts.value(*frame, "age") == Approx(2.5));
}

TEST_CASE("Every frame of a whole life of the drives is in the table, with its length", "[unit]") {
  check_traffic<Rig>(config_of(3));
  check_traffic<OdriveRig>(odrive_config_of(3));
}

TEST_CASE("Identifiers and names of frames are unique, and the signals of a frame do not overlap", "[law]") {
  MasterConfig odd = config_of(3);
  odd.axes[0].name = "a name with blanks";
  odd.axes[1].name = "fourteen_chars";
  for (const MasterConfig& config : {odd, odrive_config_of(3)}) {
    std::set<uint32_t> ids;
    std::set<std::string> names;
    const Layouts layouts(config);
    for (const FrameLayout& frame : layouts.frames()) {
      INFO(frame.name);
      CHECK(ids.insert(frame.id).second);
      CHECK(names.insert(frame.name).second);
      CHECK(frame.name.size() <= 32);
      Frame bits{.length = static_cast<uint8_t>(frame.length)};
      for (const Signal& signal : frame.signals) {
        CHECK_NOTHROW(check(signal));
        CHECK(bytes_needed(signal) <= frame.length);
        Signal raw = signal;
        raw.type = SignalType::kUnsigned, raw.scale = 1, raw.offset = 0;
        CHECK(decode(raw, bits) == 0);
        CHECK(encode(raw, std::ldexp(1.0, signal.length) - 1, bits));
      }
    }
  }
}

TEST_CASE("A DBC says name, place, type, scale and unit of each signal", "[unit]") {
  const std::string text =
      to_dbc({{.id = 385,
               .name = "Drive_a_TPDO",
               .length = 8,
               .sender = "Drive_a",
               .signals = {{.name = "p",
                            .start = 16,
                            .length = 32,
                            .type = SignalType::kFloat,
                            .scale = 0.01,
                            .offset = -3,
                            .unit = "mm"},
                           {.name = "m", .start = 7, .length = 16, .order = ByteOrder::kMotorola}}}});
  CHECK(text ==
        "VERSION \"\"\n\nNS_ :\n\nBS_:\n\nBU_: Drive_a\n\n"
        "BO_ 385 Drive_a_TPDO: 8 Drive_a\n"
        " SG_ p : 16|32@1- (0.01,-3) [0|0] \"mm\" Vector__XXX\n"
        " SG_ m : 7|16@0+ (1,0) [0|0] \"\" Vector__XXX\n\n"
        "SIG_VALTYPE_ 385 p : 1;\n");
}

}  // namespace tendril::hal::frame_layout_test
