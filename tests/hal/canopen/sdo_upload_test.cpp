// SPDX-License-Identifier: Apache-2.0
#include "hal/canopen/sdo_upload.h"

#include <catch2/catch.hpp>
#include <string>

namespace tendril::hal::sdo_upload_test {

using Status = SdoUpload::Status;

/// Reads 1008 of node 2, with 100 ns for an answer and 2 attempts, frame by frame.
struct Client {
  Client() { upload.start({0x1008, 0}); }
  std::string ask(int64_t now_ns) {
    FrameBatch out;
    status = upload.advance(now_ns, out);
    CHECK(out.size() <= 1);
    return out.size() == 0 ? "" : to_text(out[0]);
  }
  void answer(const char* text) { upload.receive(*decode_sdo_answer(*parse_frame(text), 2)); }

  SdoUpload upload{2, 100, 2};
  Status status = Status::kRunning;
};

constexpr const char* kInitiate = "602#4008100000000000";

TEST_CASE("An SDO upload fetches a long object segment by segment", "[unit]") {
  Client client;
  CHECK(client.ask(0) == kInitiate);
  CHECK(client.ask(50).empty());
  client.answer("582#4108100009000000");
  CHECK(client.ask(50) == "602#6000000000000000");
  client.answer("582#0068656C6C6F2C20");
  CHECK(client.ask(50) == "602#7000000000000000");
  client.answer("582#1B796F0000000000");
  CHECK(client.ask(50).empty());
  CHECK(client.status == Status::kDone);
  CHECK(client.upload.text() == "hello, yo");
}

TEST_CASE("An SDO upload takes an object that fits one frame, whether its size is told or not", "[unit]") {
  Client told, untold;
  told.ask(0);
  told.answer("582#4B08100041420000");
  CHECK(told.upload.text() == "AB");
  untold.ask(0);
  untold.answer("582#4208100041424344");
  CHECK(untold.upload.text() == "ABCD");
  untold.ask(1);
  CHECK(untold.status == Status::kDone);
}

TEST_CASE("An SDO upload ends with the drive's abort", "[unit]") {
  Client client;
  client.ask(0);
  client.answer("582#8009100000000206");  // of another object
  client.ask(1);
  CHECK(client.status == Status::kRunning);
  client.answer("582#8008100000000206");
  CHECK(client.ask(2).empty());
  CHECK(client.status == Status::kFailed);
  CHECK(client.upload.failure() == static_cast<uint32_t>(SdoAbort::kNoObject));
}

TEST_CASE("A segment with the wrong toggle bit is aborted and not taken", "[unit]") {
  Client client;
  client.ask(0);
  client.answer("582#4108100009000000");
  client.ask(1);
  client.answer("582#1068656C6C6F2C20");
  CHECK(client.ask(2) == "602#8008100000000305");
  CHECK(client.status == Status::kFailed);
  CHECK(client.upload.failure() == static_cast<uint32_t>(SdoAbort::kToggle));
  CHECK(client.ask(3).empty());
}

TEST_CASE("A segment that is lost begins the transfer anew, and only so often", "[unit]") {
  Client client;
  client.ask(0);
  client.answer("582#4108100009000000");
  client.ask(0);
  client.answer("582#0068656C6C6F2C20");
  client.ask(0);
  CHECK(client.ask(100) == "602#8008100000000405");
  CHECK(client.ask(100) == kInitiate);
  client.answer("582#1B796F0000000000");  // late, of the first transfer
  CHECK(client.ask(150).empty());
  client.answer("582#4108100009000000");
  CHECK(client.ask(150) == "602#6000000000000000");
  client.answer("582#0068656C6C6F2C20");
  CHECK(client.upload.text() == "hello, ");
  client.ask(150);
  CHECK(client.ask(250) == "602#8008100000000405");
  CHECK(client.status == Status::kFailed);
  CHECK(client.upload.failure() == static_cast<uint32_t>(SdoAbort::kTimeout));
}

TEST_CASE("A text that is too long is cut, and one that never ends is given up", "[unit]") {
  Client longer;
  longer.ask(0);
  longer.answer("582#4008100000000000");  // of unknown size
  int segments = 0;
  for (; longer.status == Status::kRunning && segments < 100; ++segments) {
    longer.ask(1);
    longer.answer(segments % 2 == 0 ? "582#0061616161616161" : "582#1062626262626262");
  }
  CHECK(longer.upload.text().size() == SdoUpload::kCapacity);
  CHECK(segments <= SdoUpload::kCapacity / 7 + 2);
  CHECK(longer.status == Status::kDone);

  Client empty;
  empty.ask(0);
  empty.answer("582#4008100000000000");
  empty.ask(1);
  empty.answer("582#0E00000000000000");  // no byte, and not the last
  CHECK(empty.ask(2) == "602#8008100000000008");
  CHECK(empty.status == Status::kFailed);
}

}  // namespace tendril::hal::sdo_upload_test
