// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstring>
#include <vector>

#include "hal/canopen/canopen.h"
#include "hal/canopen/drive_names.h"
#include "hal/canopen/emergency.h"
#include "hal/canopen/sdo.h"
#include "hal/canopen/sdo_sequence.h"
#include "hal/cia402/simulated_sdo_server.h"
#include "tests/fuzz/bytes.h"
#include "tests/fuzz/frames.h"
#include "tests/fuzz/inputs.h"

namespace tendril::fuzz {
namespace {

constexpr int kNode = 5;
constexpr int64_t kTimeout_ns = 100'000'000;
constexpr int kAttempts = 3;

/// What is read of a frame and written again reads the same.
void check_codecs(const hal::Frame& frame) {
  if (const auto nmt = hal::decode_nmt(frame))
    must(hal::encode_nmt(*nmt) == frame, "an NMT command is written as it was read");
  if (const auto emergency = hal::decode_emergency(frame, kNode)) {
    must(hal::decode_emergency(hal::encode_emergency(kNode, *emergency), kNode)->code == emergency->code,
         "an EMCY is written as it was read");
    must(std::strlen(hal::describe_emergency(emergency->code)) > 0, "an EMCY has words");
  }
  if (const auto state = hal::decode_heartbeat(frame, kNode))
    must(hal::decode_heartbeat(hal::encode_heartbeat(kNode, *state), kNode) == state,
         "a heartbeat is written as it was read");
  const auto request = hal::decode_sdo_request(frame, kNode);
  if (request && request->kind != hal::SdoRequest::Kind::kOther) {
    const hal::Frame written = hal::encode_sdo_request(kNode, *request);
    must(hal::encode_sdo_request(kNode, *hal::decode_sdo_request(written, kNode)) == written,
         "an SDO request is written as it was read");
  }
  const auto answer = hal::decode_sdo_answer(frame, kNode);
  if (answer && answer->kind != hal::SdoAnswer::Kind::kOther) {
    const hal::Frame written = hal::encode_sdo_answer(kNode, *answer);
    must(hal::encode_sdo_answer(kNode, *hal::decode_sdo_answer(written, kNode)) == written,
         "an SDO answer is written as it was read");
    must(answer->size >= 0 && answer->size <= 7, "an SDO answer has at most seven bytes");
    must(std::strlen(hal::describe_sdo_abort(answer->value)) > 0, "an abort has words");
  }
}

/// A list of each kind of step.
std::vector<hal::SdoStep> steps() {
  using Kind = hal::SdoRequest::Kind;
  return {{.request = {Kind::kRead, {0x1000, 0}, 0, 0}, .mask = 0, .tolerance = hal::Tolerance::kUnreadable},
          {.request = {Kind::kWrite, {0x1017, 0}, 2, 50}, .verify = true},
          {.request = {Kind::kWrite, {0x6060, 0}, 1, 8}, .tolerance = hal::Tolerance::kAny},
          {.request = {Kind::kWrite, {0x1016, 1}, 4, 0x7F'0096}, .only_if_different = true, .verify = true},
          {.request = {Kind::kRead, {0x6041, 0}, 0, 0}, .expected = 0x40, .mask = 0x4F}};
}

/// A client of SDO. Its drive answers as a real one does, as the input says, or not at all.
template <class Client, class Advance>
void run_client(Client& client, Advance ended, Bytes& bytes) {
  hal::SimulatedObjectDictionary objects(kNode, 1, 0, 0, hal::kMapTargetPosition);
  hal::SimulatedSdoServer server;
  int64_t now_ns = 1;
  hal::FrameBatch out;
  const auto advance = [&] {
    out.clear();
    const bool end = ended(now_ns, out);
    must(out.size() <= 1, "an SDO client sends at most one frame at once");
    return end;
  };
  const auto take = [&](const hal::Frame& frame) {
    check_codecs(frame);
    if (const auto answer = hal::decode_sdo_answer(frame, kNode)) client.receive(*answer);
  };
  while (!bytes.empty() && !advance()) {
    const uint8_t step = bytes.byte();
    now_ns += (step >> 2) * 5'000'000;
    if ((step & 3) == 0) take(frame_from(bytes, std::array{hal::kSdoAnswerBase + uint32_t{kNode}}));
    if ((step & 3) != 1 || out.size() == 0) continue;
    const auto request = hal::decode_sdo_request(out[0], kNode);
    must(request.has_value(), "what an SDO client sends is a request");
    const auto response = server.serve(*request, hal::NmtState::kPreOperational, objects);
    if (response.answer) take(hal::encode_sdo_answer(kNode, *response.answer));
  }
  // A drive that is silent from now on: each transfer ends after its attempts, and an abort may come between.
  constexpr int kTransfers = 16, kCalls = kTransfers * kAttempts * 3;
  for (int k = 0; k < kCalls && !advance(); ++k) now_ns += kTimeout_ns;
  must(advance(), "an SDO transfer that is not answered ends");
}

}  // namespace

bool feed_canopen_frame(const std::string& bytes) {
  Bytes left(bytes);
  constexpr std::array<uint32_t, 6> kIds = {hal::kNmtId,
                                            hal::kSyncId,
                                            hal::kEmergencyBase + kNode,
                                            hal::kHeartbeatBase + kNode,
                                            hal::kSdoAnswerBase + kNode,
                                            hal::kSdoRequestBase + kNode};
  while (!left.empty()) check_codecs(frame_from(left, kIds));
  return true;
}

bool feed_sdo(const std::string& bytes) {
  Bytes left(bytes);
  if (left.byte() & 1) {
    hal::DriveNames names(kNode, kTimeout_ns, kAttempts);
    names.start();
    run_client(
        names,
        [&](int64_t now_ns, hal::FrameBatch& out) { return names.known() || names.advance(now_ns, out); },
        left);
    for (const char letter : names.text()) must(letter >= ' ' && letter <= '~', "names can be printed");
  } else {
    const std::vector<hal::SdoStep> list = steps();
    hal::SdoSequence sequence(kNode, kTimeout_ns, kAttempts);
    sequence.start(list);
    run_client(
        sequence,
        [&](int64_t now_ns, hal::FrameBatch& out) {
          return sequence.advance(now_ns, out) != hal::SdoSequence::Status::kRunning;
        },
        left);
  }
  return true;
}

}  // namespace tendril::fuzz
