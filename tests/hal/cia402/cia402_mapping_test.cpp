// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>

#include "hal/cia402/cia402_master.h"
#include "tests/hal/rig.h"

// PDOs that others have mapped: they are read, and never written.

namespace tendril::hal::cia402_mapping_test {
using namespace tendril::hal::test;

MasterConfig as_found_config() {
  MasterConfig config = config_of(2);
  for (AxisConfig& axis : config.axes) cia402_settings(axis).mapping = Mapping::kAsFound;
  return config;
}

bool is_pdo_object(uint16_t index) { return index >= 0x1400 && index < 0x1C00; }

/// The fault with which a master meets a drive, node 2, one of whose objects shows that value.
std::string verdict(ObjectAddress object, uint32_t value) {
  Rig rig(as_found_config());
  rig.tamper = [&](int axis, Frame& frame) {
    auto answer = decode_sdo_answer(frame, 2);
    if (axis == 1 && answer && answer->object == object) {
      answer->value = value;
      frame = encode_sdo_answer(2, *answer);
    }
    return true;
  };
  rig.run_until([&] { return rig.measured.all_known || rig.faulted(); });
  return rig.faulted() ? rig.master.describe(rig.measured.fault) : "no fault";
}

TEST_CASE("A mapping that is to stay as found is read, never written, and serves", "[unit]") {
  MasterConfig config = as_found_config();
  cia402_settings(config.axes[0]).pdo = GENERATE(1, 3);
  cia402_settings(config.axes[0]).rpdo_id = 0x442;
  EnabledRig rig(config);
  for (const Frame& frame : rig.traffic)
    for (const int node : {1, 2})
      if (const auto request = decode_sdo_request(frame, node);
          request && is_pdo_object(request->object.index))
        CHECK(request->kind == SdoRequest::Kind::kRead);
  rig.follow_measured = false;
  rig.command.displacement.fill(3e-3);
  rig.run_for(100'000'000);
  for (int i = 0; i < 2; ++i) CHECK(rig.measured.displacement[i] == Approx(3e-3).margin(1e-6));
}

TEST_CASE("What differs in a mapping as found is told in words, entry by entry", "[unit]") {
  const std::string who = "axis 1 'cable 1' (node 2): drive is set up otherwise: object ";
  CHECK(verdict({0x1400, 1}, 0x80000202) ==
        who + "1400:1 (the COB-ID of RPDO 1) reads 0x80000202 and must read 0x202");
  CHECK(verdict({0x1400, 2}, 255) ==
        who + "1400:2 (the transmission type of RPDO 1) reads 0xFF and must read 0x1");
  CHECK(verdict({0x1600, 0}, 3) ==
        who + "1600:0 (the number of objects in RPDO 1) reads 0x3 and must read 0x2");
  CHECK(verdict({0x1600, 1}, 0x607A0020) ==
        who + "1600:1 (the first object in RPDO 1) reads 0x607A0020 and must read 0x60400010");
  CHECK(verdict({0x1600, 2}, 0x60FF0020) ==
        who + "1600:2 (the second object in RPDO 1) reads 0x60FF0020 and must read 0x607A0020");
  CHECK(verdict({0x1800, 1}, 0x382) == who + "1800:1 (the COB-ID of TPDO 1) reads 0x382 and must read 0x182");
  CHECK(verdict({0x1800, 2}, 2) ==
        who + "1800:2 (the transmission type of TPDO 1) reads 0x2 and must read 0x1");
  CHECK(verdict({0x1A00, 0}, 1) ==
        who + "1A00:0 (the number of objects in TPDO 1) reads 0x1 and must read 0x2");
  CHECK(verdict({0x1A00, 1}, 0) ==
        who + "1A00:1 (the first object in TPDO 1) reads 0x0 and must read 0x60410010");
  CHECK(verdict({0x1A00, 2}, 0x606C0020) ==
        who + "1A00:2 (the second object in TPDO 1) reads 0x606C0020 and must read 0x60640020");
}

TEST_CASE("A TPDO that cannot be requested is as good as one that can", "[unit]") {
  CHECK(verdict({0x1800, 1}, 0x40000182) == "no fault");
}

TEST_CASE("A drive that comes without a mapping is refused where it is to stay as found", "[unit]") {
  Rig rig(as_found_config());
  rig.drives[0] = SimulatedCia402Drive({.node = 1});
  CHECK(rig.fault().kind == FaultKind::kUnexpectedValue);
  CHECK(rig.measured.fault.object == 0x140001);
  CHECK(rig.measured.fault.axis == 0);
}

}  // namespace tendril::hal::cia402_mapping_test
