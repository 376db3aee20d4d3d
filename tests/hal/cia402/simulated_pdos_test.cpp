// SPDX-License-Identifier: Apache-2.0
#include "hal/cia402/simulated_pdos.h"

#include "tests/hal/cia402/simulated_drive_bench.h"

// The PDOs of the simulated drive: what may be set up, when they go, and what they hold.

namespace tendril::hal::simulated_pdos_test {
using namespace tendril::hal::test;

constexpr int64_t kMillisecond_ns = 1'000'000;
const std::string kDone = "60", kWrong = "8030000906";

/// A drive, node 2, in pre-operational, whose PDOs are off.
struct PdoBench : Bench {
  PdoBench() { advance(0); }

  /// What a write of up to four bytes brings: "60", or "80" and the abort code as on the wire.
  std::string write(int index, int sub, int size, uint32_t value) {
    const SdoRequest request{
        SdoRequest::Kind::kWrite, {static_cast<uint16_t>(index), static_cast<uint8_t>(sub)}, size, value};
    const std::string answer = sdo(to_text(encode_sdo_request(2, request)).substr(4));
    return answer.substr(0, 2) == "80" ? "80" + answer.substr(8) : answer.substr(0, 2);
  }

  /// Fills a map, and switches its PDO on.
  void map(int communication, const std::vector<uint32_t>& objects, uint32_t cob_id, uint32_t type) {
    const int mapping = communication + 0x200;
    for (size_t i = 0; i < objects.size(); ++i)
      REQUIRE(write(mapping, static_cast<int>(i) + 1, 4, objects[i]) == kDone);
    REQUIRE(write(mapping, 0, 1, static_cast<uint32_t>(objects.size())) == kDone);
    REQUIRE(write(communication, 2, 1, type) == kDone);
    REQUIRE(write(communication, 1, 4, cob_id) == kDone);
  }
};

TEST_CASE("PDOs can be mapped only in the order and with the objects of the standard", "[unit]") {
  const std::string not_mappable = "8041000406", too_long = "8042000406", in_use = "8000000106";
  PdoBench bench;
  CHECK(bench.write(0x1600, 1, 4, 0x60400010) == kDone);         // off at power-on
  CHECK(bench.write(0x1600, 2, 4, 0x60640020) == not_mappable);  // not to be received
  CHECK(bench.write(0x1600, 2, 4, 0x60650020) == not_mappable);  // at all
  CHECK(bench.write(0x1600, 2, 4, 0x607A0010) == not_mappable);  // of another length
  CHECK(bench.write(0x1600, 2, 4, 0x60000020) == not_mappable);  // no such object
  CHECK(bench.write(0x1600, 0, 1, 2) == not_mappable);           // count 2, but the second is empty
  CHECK(bench.write(0x1600, 0, 1, 9) == too_long);
  for (int sub = 2; sub <= 3; ++sub) CHECK(bench.write(0x1600, sub, 4, 0x607A0020) == kDone);
  CHECK(bench.write(0x1600, 0, 1, 3) == too_long);    // ten bytes
  CHECK(bench.write(0x1400, 1, 4, 0x202) == kWrong);  // on, with an empty map
  CHECK(bench.write(0x1600, 0, 1, 2) == kDone);
  CHECK(bench.write(0x1600, 3, 4, 0) == in_use);
  for (const uint32_t id : {0x000, 0x07F, 0x102, 0x180, 0x582, 0x602, 0x6E0, 0x702, 0x7FF})
    CHECK(bench.write(0x1400, 1, 4, id) == kWrong);
  CHECK(bench.write(0x1400, 1, 4, 0x2000'0202) == kWrong);  // 29 bits
  CHECK(bench.write(0x1400, 1, 4, 0x202) == kDone);         // on
  CHECK(bench.write(0x1600, 0, 1, 0) == in_use);
  CHECK(bench.write(0x1400, 1, 4, 0x203) == kWrong);  // other identifier while on
  CHECK(bench.write(0x1400, 1, 4, 0x8000'0202) == kDone);
  bench.say("000#0102");
  CHECK(bench.write(0x1400, 1, 4, 0x202) == "8022000008");  // not in operational
}

TEST_CASE("A PDO has a transmission type that is served, or refuses it", "[unit]") {
  PdoBench bench;
  for (const int communication : {0x1400, 0x1800}) {
    for (const uint32_t type : {0u, 1u, 240u, 254u, 255u})
      CHECK(bench.write(communication, 2, 1, type) == kDone);
    for (const uint32_t type : {241u, 251u, 252u, 253u})
      CHECK(bench.write(communication, 2, 1, type) == kWrong);
  }
}

TEST_CASE("The mapping that the master wrote decides what the bytes mean", "[unit]") {
  Bench bench;
  bench.advance(0);
  // Position before statusword, target before controlword, on other identifiers.
  for (const char* bytes :
       {"2300160120007A60", "2300160210004060", "2F00160002000000", "2F00140201000000", "230014010A030000",
        "23001A0120006460", "23001A0210004160", "2F001A0002000000", "2300180199010000", "2F60600008000000"}) {
    CAPTURE(bytes);
    REQUIRE(bench.sdo(bytes).substr(0, 2) == "60");
  }
  bench.say("000#0102");
  bench.say("30A#F40100000600");
  CHECK(bench.say("080#") == Texts{"199#F40100003102"});
  CHECK(bench.drive.state() == DriveState::kReady);
}

TEST_CASE("Bit 30 of a COB-ID, by which masters forbid remote frames, leaves the PDO as it is", "[unit]") {
  Bench bench;
  bench.set_up();
  bench.say("000#8002");
  CHECK(bench.sdo("2300140102020040") == "6000140100000000");  // 1400:1 = 40000202
  CHECK(bench.sdo("2300180182010040") == "6000180100000000");  // 1800:1 = 40000182
  bench.say("000#0102");
  CHECK(bench.cycle(0x06, 0) == Texts{"182#3102F4010000"});
  CHECK(bench.sdo("2300140102020080") == "8000140122000008");  // switched off in pre-operational alone
  bench.say("000#8002");
  CHECK(bench.sdo("23001401020200C0") == "6000140100000000");
  bench.say("000#0102");
  CHECK(bench.cycle(0x07, 0) == Texts{"182#3102F4010000"});
}

TEST_CASE("A PDO holds up to eight objects, in the order of its map", "[unit]") {
  PdoBench bench;
  bench.map(0x1400, {0x60400010, 0x60600008, 0x607A0020}, 0x202, 1);
  bench.map(0x1800, {0x10010008, 0x603F0010, 0x60610008, 0x60600008, 0x60410010, 0x10010008}, 0x182, 1);
  bench.say("000#0102");
  bench.say("202#06000878563412");
  CHECK(bench.say("080#") == Texts{"182#0000000808310200"});
  CHECK(bench.sdo("407A600000000000") == "437A600078563412");
  bench.say("202#07000178563412");  // a mode that the drive has not is passed over, what comes with it is not
  CHECK(bench.say("080#") == Texts{"182#0000000808330200"});
  bench.say("000#8002");
  CHECK(bench.write(0x1800, 1, 4, 0x8000'0182) == kDone);
  CHECK(bench.write(0x1A00, 0, 1, 0) == kDone);
  bench.map(0x1800, std::vector<uint32_t>(8, 0x60610008), 0x182, 1);
  bench.say("000#0102");
  CHECK(bench.say("080#") == Texts{"182#0808080808080808"});
}

TEST_CASE("A TPDO goes with every n-th SYNC, or with the one after a change", "[unit]") {
  PdoBench bench;
  bench.map(0x1400, {0x60400010}, 0x202, 0);
  const uint32_t type = GENERATE(0u, 3u);
  CAPTURE(type);
  bench.map(0x1800, {0x60410010}, 0x182, type);
  bench.say("000#0102");
  std::string sent;
  for (int k = 0; k < 7; ++k) {
    if (k == 4) CHECK(bench.say("202#0600").empty());
    const Texts answers = bench.say("080#");
    sent += answers.empty() ? "- " : answers.at(0).substr(4) + ' ';
    bench.advance(kMillisecond_ns);
  }
  CHECK(sent == (type == 0 ? "5002 - - - 3102 - - " : "- - 5002 - - 3102 - "));
}

TEST_CASE(
    "A TPDO that waits for no SYNC goes on a change, no sooner than its inhibit time, and with its timer",
    "[unit]") {
  PdoBench bench;
  CHECK(bench.write(0x1800, 3, 2, 20) == kDone);  // 2 ms
  CHECK(bench.write(0x1800, 5, 2, 50) == kDone);  // 50 ms
  bench.map(0x1400, {0x60400010}, 0x202, 255);
  bench.map(0x1800, {0x60410010}, 0x182, GENERATE(254u, 255u));
  CHECK(bench.write(0x1800, 3, 2, 0) == "8000000106");  // while it is on
  bench.say("000#0102");
  std::string sent;
  for (int ms = 1; ms <= 60; ++ms) {
    const auto note = [&](const Texts& texts) {
      for (const std::string& text : texts) sent += std::to_string(ms) + ' ' + text.substr(4) + ' ';
    };
    if (ms == 5) note(bench.say("202#0600"));
    if (ms == 6) note(bench.say("202#0700"));
    note(bench.say("080#"));
    note(bench.advance(kMillisecond_ns));
  }
  CHECK(sent == "1 5002 5 3102 6 3302 56 3302 ");
}

TEST_CASE("An RPDO that is too short is reported once, not applied, and over with the next good one",
          "[unit]") {
  Bench bench;
  bench.set_up();
  CHECK(bench.say("202#0600F40100") == Texts{"082#1082110000000000"});
  CHECK(bench.say("202#0600F40100").empty());
  CHECK(bench.sdo("4001100000000000") == "4F01100011000000");
  bench.say("080#");
  CHECK(bench.drive.state() == DriveState::kSwitchOnDisabled);
  bench.drive.inject_fault(0x4310);
  bench.advance(0);
  CHECK(bench.sdo("4001100000000000") == "4F01100019000000");             // both
  CHECK(bench.say("202#0000F4010000") == Texts{"082#0000090000000000"});  // what is left
  CHECK(bench.sdo("4001100000000000") == "4F01100009000000");
}

TEST_CASE("A start of a node that runs already changes nothing", "[unit]") {
  Bench bench;
  bench.set_up();
  bench.say("202#0600F4010000");
  bench.sdo("4008100000000000");
  bench.say("000#0102");
  CHECK(bench.sdo("6000000000000000") == "0074656E6472696C");  // a name in segments goes on
  CHECK(bench.say("080#") == Texts{"182#3102F4010000"});       // and the target is taken
  bench.say("202#0700F4010000");
  bench.say("000#8002");
  CHECK(bench.sdo("7000000000000000") == "132D706C616E7400");  // in pre-operational too
  bench.say("000#0102");
  CHECK(bench.say("080#") == Texts{"182#3102F4010000"});  // what came before is void
  bench.sdo("4008100000000000");
  bench.say("000#0202");
  bench.say("000#8002");
  CHECK(bench.sdo("6000000000000000") == "8008100001000405");  // a stop ends it
}

TEST_CASE("The error register lasts as long as its errors, and the history keeps the last four", "[unit]") {
  Bench bench;
  bench.set_up();
  for (const uint16_t code : std::initializer_list<uint16_t>{0x2310, 0x3210, 0x4310, 0x5530, 0x7305}) {
    bench.cycle(0x00, 0);
    bench.drive.inject_fault(code);
    for (int k = 0; k < 2; ++k) bench.advance(kMillisecond_ns);
    if (code != 0x7305) bench.cycle(0x80, 0);
  }
  CHECK(bench.sdo("4003100000000000") == "4F03100004000000");
  const char* expected[] = {"05730000", "30550000", "10430000", "10320000"};
  for (int k = 0; k < 4; ++k)
    CHECK(bench.sdo("4003100" + std::to_string(k + 1) + "00000000") ==
          "4303100" + std::to_string(k + 1) + expected[k]);
  CHECK(bench.sdo("2F03100002000000") == "8003100030000906");  // 0 alone may be written
  bench.say("000#8202");
  bench.advance(0);
  REQUIRE(bench.drive.state() == DriveState::kFault);
  CHECK(bench.sdo("4001100000000000") == "4F01100001000000");  // it is still there
  CHECK(bench.sdo("403F600000000000") == "4B3F600005730000");
  CHECK(bench.sdo("2F03100000000000") == "6003100000000000");
  CHECK(bench.sdo("4003100100000000") == "4303100100000000");
  bench.say("000#8102");
  bench.advance(0);
  CHECK(bench.sdo("4001100000000000") == "4F01100000000000");
  CHECK(bench.sdo("403F600000000000") == "4B3F600000000000");
}

}  // namespace tendril::hal::simulated_pdos_test
