// SPDX-License-Identifier: Apache-2.0
#include "hal/drive/other_master.h"

#include <catch2/catch.hpp>

#include "tests/hal/rig.h"

namespace tendril::hal::other_master_test {

using test::OdriveRig, test::Rig;

constexpr int64_t kMillisecond_ns = 1'000'000;
constexpr int64_t kListen_ns = 200 * kMillisecond_ns;

MasterConfig listening(MasterConfig config) {
  config.listen_ns = kListen_ns;
  return config;
}

TEST_CASE(
    "Three frames of one identifier within the time of listening are another controller, fewer are strays",
    "[unit]") {
  OtherMaster other({0x080, 0x201}, 100);
  CHECK(other.listening(1000));
  CHECK(other.listening(1099));
  CHECK_FALSE(other.listening(1100));
  other.receive({.id = 0x080}, 1000);
  other.receive({.id = 0x201}, 1001);
  other.receive({.id = 0x080}, 1002);
  other.receive({.id = 0x201}, 1003);
  CHECK_FALSE(other.heard());
  other.receive({.id = 0x080}, 1200);  // the first two are forgotten
  CHECK_FALSE(other.heard());
  other.receive({.id = 0x080}, 1201);
  other.receive({.id = 0x080}, 1202);
  REQUIRE(other.heard());
  CHECK(other.heard_id() == 0x080);
}

TEST_CASE("Remote frames, extended ones, and those that drives send tell of no other controller", "[unit]") {
  OtherMaster other({0x080}, 100);
  for (int i = 0; i < 10; ++i) {
    CHECK_FALSE(other.receive({.id = 0x080, .remote = true}, i));
    CHECK_FALSE(other.receive({.id = 0x080, .extended = true}, i));
    CHECK_FALSE(other.receive({.id = 0x181, .length = 6}, i));
  }
  CHECK_FALSE(other.heard());
}

TEST_CASE("Nothing is heard any more once the drives follow us, nor where no time is given to listen",
          "[unit]") {
  OtherMaster following({0x080}, 100), deaf({0x080}, 0);
  CHECK_FALSE(deaf.listening(1));
  following.end();
  for (int i = 0; i < 10; ++i) {
    CHECK(following.receive({.id = 0x080}, i));
    CHECK(deaf.receive({.id = 0x080}, i));
  }
  CHECK_FALSE(following.heard());
  CHECK_FALSE(deaf.heard());
}

/// A second controller comes to a bus on which a first one has enabled the drives.
template <class AnyRig, class Master>
void second_begins_beside_first(const MasterConfig& config) {
  AnyRig rig(config);
  REQUIRE(rig.enable());
  VirtualEndpoint& plug = rig.bus.attach("second");
  Master second(listening(config));
  Command command{.enable = true, .axes = static_cast<int>(config.axes.size())};
  Measurement seen;
  int sent = 0;
  for (int cycle = 0; cycle < 1000; ++cycle) {
    Frame frame;
    while (plug.receive(frame)) second.receive(frame, frame.stamp_ns);
    seen = second.measure(BusHealth::kActive, rig.bus.time_ns());
    FrameBatch out;
    command.finish = seen.fault.kind != FaultKind::kNone;
    command.enable = !command.finish;
    second.command(command, rig.bus.time_ns(), out);
    sent += static_cast<int>(out.size());
    for (const Frame& each : out) plug.send(each);
    rig.cycle();
  }
  CHECK(sent == 0);
  CHECK(seen.finished);
  CHECK(seen.fault.kind == FaultKind::kOtherMaster);
  CHECK_THAT(second.describe(seen.fault), Catch::Contains("another controller"));
  CHECK_FALSE(rig.faulted());
  CHECK(rig.measured.all_enabled);
}

TEST_CASE("Beside a running controller a second one sends nothing, and says why", "[law]") {
  second_begins_beside_first<Rig, Cia402Master>(test::config_of(2));
  second_begins_beside_first<OdriveRig, OdriveMaster>(test::odrive_config_of(2));
}

TEST_CASE("A controller that is alone begins after the time of listening, with its first frame", "[law]") {
  const auto begins_in_time = [](auto&& rig) {
    const int64_t start_ns = rig.bus.time_ns();
    REQUIRE(rig.run_until([&] { return rig.batch.size() > 0; }));
    CHECK(rig.bus.time_ns() - start_ns >= kListen_ns);
    CHECK(rig.bus.time_ns() - start_ns <= kListen_ns + 2 * test::kPeriod_ns);
    CHECK(rig.enable());
  };
  begins_in_time(Rig(listening(test::config_of(2))));
  begins_in_time(OdriveRig(listening(test::odrive_config_of(2))));
}

}  // namespace tendril::hal::other_master_test
