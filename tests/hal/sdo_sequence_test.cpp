#include "hal/sdo_sequence.h"

#include <catch2/catch.hpp>
#include <string>

using namespace tendril::hal;

namespace {

const SdoStep kSteps[] = {{{SdoRequest::Kind::kWrite, {0x6060, 0}, 1, 8}, 0},
                          {{SdoRequest::Kind::kRead, {0x6061, 0}, 0, 0}, 8},
                          {{SdoRequest::Kind::kWrite, {0x1017, 0}, 2, 50}, 0}};

/// A sequence with node 2, 100 ns and 2 attempts, and its requests as text.
struct Client {
  Client() { sequence.start(kSteps); }
  std::string ask(int64_t now_ns) {
    FrameBatch out;
    status = sequence.advance(now_ns, out);
    return out.size() == 0 ? "" : to_text(out[0]);
  }
  void answer(const char* text) { sequence.receive(*decode_sdo_answer(*parse_frame(text), 2)); }

  SdoSequence sequence{2, 100, 2};
  SdoSequence::Status status = SdoSequence::Status::kRunning;
};

}  // namespace

TEST_CASE("An SDO sequence asks one question at a time, to the end", "[unit]") {
  Client client;
  CHECK(client.ask(0) == "602#2F60600008000000");
  CHECK(client.ask(99).empty());
  client.answer("582#6060600000000000");
  CHECK(client.ask(99) == "602#4061600000000000");
  client.answer("582#4F61600008000000");
  CHECK(client.ask(99) == "602#2B17100032000000");
  CHECK(client.status == SdoSequence::Status::kRunning);
  client.answer("582#6017100000000000");
  CHECK(client.ask(99).empty());
  CHECK(client.status == SdoSequence::Status::kDone);
}

TEST_CASE("An SDO answer to another question is ignored", "[unit]") {
  Client client;
  client.answer("582#6060600000000000");  // to nothing that was asked
  CHECK(client.ask(0) == "602#2F60600008000000");
  client.answer("582#6017100000000000");  // another object
  client.answer("582#4F60600008000000");  // a value for a write
  client.answer("582#8017100000000206");  // the abort of another transfer
  CHECK(client.ask(50).empty());
  CHECK(client.status == SdoSequence::Status::kRunning);
  CHECK(client.ask(100) == "602#2F60600008000000");  // asked again
  client.answer("582#6060600000000000");             // the first answer, late
  CHECK(client.ask(100) == "602#4061600000000000");
  client.answer("582#6060600000000000");  // the second one
  CHECK(client.ask(150).empty());
  client.answer("582#4F61600008000000");
  CHECK(client.ask(150) == "602#2B17100032000000");
}

TEST_CASE("An SDO sequence gives up after its attempts and says at what", "[unit]") {
  Client silent;
  CHECK_FALSE(silent.ask(0).empty());
  CHECK_FALSE(silent.ask(100).empty());
  CHECK(silent.ask(200).empty());
  CHECK(silent.status == SdoSequence::Status::kFailed);
  CHECK(silent.sequence.failure() == static_cast<uint32_t>(SdoAbort::kTimeout));
  CHECK(silent.sequence.step().request.object == ObjectAddress{0x6060, 0});

  Client refused;
  refused.ask(0);
  refused.answer("582#8060600022000008");
  refused.ask(1);
  CHECK(refused.status == SdoSequence::Status::kFailed);
  CHECK(refused.sequence.failure() == 0x08000022);
}

TEST_CASE("A value is compared in the bits that count, and told where it is another", "[unit]") {
  const SdoStep step{{SdoRequest::Kind::kRead, {0x1800, 1}, 0, 0}, 0x182, ~0x4000'0000u};
  for (const bool other : {false, true}) {
    SdoSequence sequence(2, 100, 1);
    sequence.start({&step, 1});
    FrameBatch out;
    sequence.advance(0, out);
    sequence.receive(
        *decode_sdo_answer(*parse_frame(other ? "582#4300180183010040" : "582#4300180182010040"), 2));
    CHECK(sequence.advance(100, out) == (other ? SdoSequence::Status::kFailed : SdoSequence::Status::kDone));
    CHECK(sequence.failure() == 0);
    CHECK(sequence.found() == (other ? 0x4000'0183 : 0x4000'0182));
  }
}
