// SPDX-License-Identifier: Apache-2.0
#include "hal/canopen/emergency.h"

#include <algorithm>

#include "hal/bus/little_endian.h"
#include "hal/canopen/canopen.h"

namespace tendril::hal {

Frame encode_emergency(int node, const Emergency& emergency) noexcept {
  Frame frame{.id = kEmergencyBase + node, .length = 8};
  put(frame.data, 0, emergency.code);
  frame.data[2] = emergency.error_register;
  std::copy(emergency.detail.begin(), emergency.detail.end(), frame.data.begin() + 3);
  return frame;
}

std::optional<Emergency> decode_emergency(const Frame& frame, int node) noexcept {
  constexpr int kLeast = 3, kWhole = 8;  // bytes
  if (frame.id != kEmergencyBase + node || frame.extended || frame.remote) return std::nullopt;
  if (frame.length < kLeast || frame.length > kWhole) return std::nullopt;
  Emergency emergency{.code = get<uint16_t>(frame.data, 0), .error_register = frame.data[2]};
  std::copy_n(frame.data.begin() + kLeast, frame.length - kLeast, emergency.detail.begin());
  return emergency;
}

const char* describe_emergency(uint16_t code) noexcept {
  switch (code) {
    case 0x0000:
      return "error reset or no error";
    case 0x2310:
      return "continuous overcurrent at the output";
    case 0x2320:
      return "short circuit or earth leakage at the output";
    case 0x3110:
      return "mains overvoltage";
    case 0x3120:
      return "mains undervoltage";
    case 0x3210:
      return "overvoltage of the DC link";
    case 0x3220:
      return "undervoltage of the DC link";
    case 0x4210:
      return "device too hot";
    case 0x4310:
      return "drive too hot";
    case 0x5530:
      return "non-volatile memory";
    case 0x6010:
      return "software reset by the watchdog";
    case 0x6320:
      return "parameter error";
    case 0x7121:
      return "motor blocked";
    case 0x7122:
      return "motor or commutation";
    case 0x7305:
      return "incremental encoder 1";
    case 0x8110:
      return "CAN overrun";
    case 0x8120:
      return "CAN error-passive";
    case 0x8130:
      return "heartbeat of the master lost";
    case 0x8140:
      return "recovered from bus-off";
    case 0x8150:
      return "two senders of one COB-ID";
    case 0x8210:
      return "PDO too short";
    case 0x8220:
      return "PDO too long";
    case 0x8250:
      return "time-out of an RPDO";
    case 0x8611:
      return "following error";
    case 0x8612:
      return "reference limit";
    default:
      break;
  }
  switch (code >> 8) {
    case 0x21:
      return "current on the input side";
    case 0x22:
      return "current inside the drive";
    case 0x23:
      return "current on the output side";
    case 0x31:
      return "mains voltage";
    case 0x32:
      return "voltage inside the drive";
    case 0x33:
      return "output voltage";
    case 0x41:
      return "ambient temperature";
    case 0x42:
      return "device temperature";
    case 0x43:
      return "drive temperature";
    case 0x44:
      return "supply temperature";
    case 0x51:
      return "supply of the drive's electronics";
    case 0x52:
      return "control electronics";
    case 0x53:
      return "operating unit";
    case 0x54:
      return "power section";
    case 0x55:
      return "data storage";
    case 0x61:
      return "internal software";
    case 0x62:
      return "user software";
    case 0x63:
      return "data set";
    case 0x71:
      return "power stage";
    case 0x72:
      return "measuring circuit";
    case 0x73:
      return "sensor or encoder";
    case 0x74:
      return "computing circuit";
    case 0x75:
      return "communication circuit";
    case 0x81:
      return "communication";
    case 0x82:
      return "protocol";
    case 0x83:
      return "torque controller";
    case 0x84:
      return "speed controller";
    case 0x85:
      return "position controller";
    case 0x86:
      return "positioning";
    case 0x90:
      return "external error";
    default:
      break;
  }
  switch (code >> 12) {
    case 0x1:
      return "generic error";
    case 0x2:
      return "current";
    case 0x3:
      return "voltage";
    case 0x4:
      return "temperature";
    case 0x5:
      return "drive hardware";
    case 0x6:
      return "drive software";
    case 0x7:
      return "additional module";
    case 0x8:
      return "monitoring";
    case 0xF:
      return "additional function";
    default:
      return "error of no known class";
  }
}

}  // namespace tendril::hal
