// SPDX-License-Identifier: Apache-2.0
#include "hal/canopen/sdo_sequence.h"

#include <catch2/catch.hpp>
#include <string>

namespace tendril::hal::sdo_sequence_test {

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

TEST_CASE("A value that a drive sends in segments is as good as one in a single frame", "[unit]") {
  Client client;
  client.ask(0);
  client.answer("582#6060600000000000");
  CHECK(client.ask(0) == "602#4061600000000000");
  client.answer("582#4161600001000000");  // one byte to come
  CHECK(client.ask(0) == "602#6000000000000000");
  client.answer("582#0D08000000000000");
  CHECK(client.ask(0) == "602#2B17100032000000");
}

TEST_CASE("A read that is not answered is aborted and asked again, as often as a write", "[unit]") {
  const SdoStep step{{SdoRequest::Kind::kRead, {0x6061, 0}, 0, 0}, 8};
  SdoSequence sequence(2, 100, 2);
  sequence.start({&step, 1});
  std::string said;
  for (const int64_t now_ns : {0, 99, 100, 100, 199, 200, 200}) {
    FrameBatch out;
    sequence.advance(now_ns, out);
    CHECK(out.size() <= 1);
    said += out.size() == 0 ? "- " : to_text(out[0]).substr(4, 8) + ' ';
  }
  CHECK(said == "40616000 - 80616000 40616000 - 80616000 - ");
  FrameBatch out;
  CHECK(sequence.advance(200, out) == SdoSequence::Status::kFailed);
  CHECK(sequence.failure() == static_cast<uint32_t>(SdoAbort::kTimeout));
}

TEST_CASE("A value that is there already is not written again", "[unit]") {
  for (const bool same : {false, true}) {
    const SdoStep step{.request = {SdoRequest::Kind::kWrite, {0x60C2, 2}, 1, 0xFD},
                       .only_if_different = true};
    SdoSequence sequence(2, 100, 1);
    sequence.start({&step, 1});
    FrameBatch out;
    sequence.advance(0, out);
    sequence.receive(
        *decode_sdo_answer(*parse_frame(same ? "582#4FC26002FD000000" : "582#4FC26002FC000000"), 2));
    CHECK(sequence.advance(1, out) == (same ? SdoSequence::Status::kDone : SdoSequence::Status::kRunning));
    REQUIRE(out.size() == (same ? 1 : 2));
    CHECK(to_text(out[0]) == "602#40C2600200000000");
    if (same) continue;
    CHECK(to_text(out[1]) == "602#2FC26002FD000000");
    sequence.receive(*decode_sdo_answer(*parse_frame("582#60C2600200000000"), 2));
    CHECK(sequence.advance(2, out) == SdoSequence::Status::kDone);
  }
}

TEST_CASE(
    "An object that cannot be read is passed over where it is optional, one that cannot be written is not",
    "[unit]") {
  for (const bool only_if_different : {false, true})
    for (const char* refusal : {"582#80C2600200000206", "582#80C2600202000106", "582#80C2600200000008"}) {
      const SdoStep step{.request = {SdoRequest::Kind::kWrite, {0x60C2, 2}, 1, 0xFD},
                         .only_if_different = only_if_different,
                         .tolerance = Tolerance::kUnreadable};
      SdoSequence sequence(2, 100, 1);
      sequence.start({&step, 1});
      FrameBatch out;
      sequence.advance(0, out);
      sequence.receive(*decode_sdo_answer(*parse_frame(refusal), 2));
      CHECK(sequence.advance(1, out) ==
            (only_if_different ? SdoSequence::Status::kDone : SdoSequence::Status::kFailed));
    }
}

/// What becomes of a write that is to be read back, by the answers of the drive in turn.
SdoSequence::Status verified(std::initializer_list<const char*> answers) {
  const SdoStep step{.request = {SdoRequest::Kind::kWrite, {0x1400, 2}, 1, 1}, .verify = true};
  SdoSequence sequence(2, 100, 2);
  sequence.start({&step, 1});
  FrameBatch out;
  int64_t now_ns = 0;
  for (const char* answer : answers) {
    if (sequence.advance(now_ns, out) != SdoSequence::Status::kRunning) break;
    sequence.receive(*decode_sdo_answer(*parse_frame(answer), 2));
    now_ns += 100;
  }
  return sequence.advance(now_ns, out);
}

TEST_CASE("A value that must be read back counts as written once the drive shows it", "[unit]") {
  constexpr const char *kWritten = "582#6000140200000000", *kShows1 = "582#4F00140201000000",
                       *kShows255 = "582#4F001402FF000000";
  CHECK(verified({kWritten}) == SdoSequence::Status::kRunning);
  CHECK(verified({kWritten, kShows1}) == SdoSequence::Status::kDone);
  CHECK(verified({kWritten, kShows255, kShows1}) ==
        SdoSequence::Status::kDone);  // a drive that takes its time
  CHECK(verified({kWritten, kShows255, kShows255}) == SdoSequence::Status::kFailed);
  CHECK(verified({kWritten, "582#8000140201000106"}) == SdoSequence::Status::kDone);    // write-only
  CHECK(verified({kWritten, "582#8000140200000008"}) == SdoSequence::Status::kFailed);  // any other refusal
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

}  // namespace tendril::hal::sdo_sequence_test
