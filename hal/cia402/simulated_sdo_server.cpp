// SPDX-License-Identifier: Apache-2.0
#include "hal/cia402/simulated_sdo_server.h"

#include <algorithm>

#include "hal/cia402/simulated_pdos.h"

namespace tendril::hal {
namespace {

SdoAnswer aborted(ObjectAddress object, uint32_t abort_code) noexcept {
  return {SdoAnswer::Kind::kAbort, object, 0, abort_code};
}

}  // namespace

SimulatedSdoServer::Response SimulatedSdoServer::serve(const SdoRequest& request, NmtState state,
                                                       SimulatedObjectDictionary& objects) noexcept {
  if (request.kind != SdoRequest::Kind::kReadSegment) end_upload();
  switch (request.kind) {
    case SdoRequest::Kind::kWrite:
      return write(request, state, objects);
    case SdoRequest::Kind::kRead:
      return {read(request.object, objects)};
    case SdoRequest::Kind::kReadSegment:
      return {next_segment(request.toggle)};
    case SdoRequest::Kind::kAbort:
      return {};
    case SdoRequest::Kind::kOther:
      break;
  }
  return {aborted(request.object, code(SdoAbort::kUnknownCommand))};
}

SimulatedSdoServer::Response SimulatedSdoServer::write(const SdoRequest& request, NmtState state,
                                                       SimulatedObjectDictionary& objects) noexcept {
  auto [entry, value, abort] = objects.check_write(request);
  const bool of_pdo = abort == 0 && is_pdo_setting(entry);
  if (of_pdo && state != NmtState::kPreOperational) abort = code(SdoAbort::kDeviceState);
  if (of_pdo && abort == 0) abort = check_pdo_setting(objects, entry, value);
  if (abort == 0) abort = SimulatedObjectDictionary::check_value(entry, value);
  if (abort != 0) return {aborted(request.object, abort)};
  objects.write(entry, value);
  return {SdoAnswer{SdoAnswer::Kind::kWritten, request.object, 0, 0}, entry};
}

SdoAnswer SimulatedSdoServer::read(ObjectAddress object, const SimulatedObjectDictionary& objects) noexcept {
  const std::string_view text = SimulatedObjectDictionary::text(object);
  if (text.empty()) return objects.read(object);
  upload_ = object;
  upload_left_ = text;
  upload_toggle_ = false;
  return {SdoAnswer::Kind::kSegmented, object, 0, static_cast<uint32_t>(text.size())};
}

SdoAnswer SimulatedSdoServer::next_segment(bool toggle) noexcept {
  const bool running = !upload_left_.empty(), in_turn = toggle == upload_toggle_;
  if (!running || !in_turn) {
    end_upload();
    return aborted(upload_, code(running ? SdoAbort::kToggle : SdoAbort::kUnknownCommand));
  }
  SdoAnswer answer{.kind = SdoAnswer::Kind::kSegment, .object = {}, .size = 0, .value = 0, .toggle = toggle};
  answer.size = static_cast<int>(std::min(upload_left_.size(), answer.segment.size()));
  std::copy_n(upload_left_.begin(), answer.size, answer.segment.begin());
  upload_left_.remove_prefix(static_cast<size_t>(answer.size));
  answer.last = upload_left_.empty();
  upload_toggle_ = !upload_toggle_;
  return answer;
}

}  // namespace tendril::hal
