// SPDX-License-Identifier: Apache-2.0
#include "tests/app/daemon/bus_listener.h"

#include <catch2/catch.hpp>
#include <chrono>
#include <sstream>

#include "hal/bus/open_bus.h"
#include "tests/patience.h"

namespace tendril::app {
namespace {

constexpr auto kPoll = std::chrono::milliseconds(1);

}  // namespace

BusListener::BusListener(const std::string& bus, std::vector<int> nodes)
    : nodes_(std::move(nodes)),
      bus_(hal::open_bus(bus, hal::BusRole::kJoin)),
      thread_([this] { listen(); }) {}

BusListener::~BusListener() {
  {
    const std::lock_guard lock(mutex_);
    quit_ = true;
  }
  thread_.join();
}

void BusListener::listen() {
  for (bool quit = false; !quit; std::this_thread::sleep_for(kPoll)) {
    const std::lock_guard lock(mutex_);
    for (hal::Frame frame; bus_->receive(frame);) take_in(frame);
    quit = quit_;
  }
}

void BusListener::take_in(const hal::Frame& frame) {
  ++heard_.frames[frame.id];
  for (const int node : nodes_) {
    if (const auto feedback = hal::decode_drive_feedback(hal::kTpdo1Base + node, frame))
      heard_.feedback[node] = *feedback;
    if (const auto command = hal::decode_drive_command(hal::kRpdo1Base + node, frame))
      heard_.command[node] = *command;
    if (const auto emergency = hal::decode_emergency(frame, node))
      heard_.emergencies[node].push_back(emergency->code);
    if (const auto answer = hal::decode_sdo_answer(frame, node);
        answer && answer->kind == hal::SdoAnswer::Kind::kValue)
      heard_.answer[node] = answer->value;
  }
}

Heard BusListener::heard() const {
  const std::lock_guard lock(mutex_);
  return heard_;
}

bool BusListener::until(const std::function<bool(const Heard&)>& condition) {
  const auto deadline =
      std::chrono::steady_clock::now() + std::chrono::duration<double>(tendril::testing::kPatience_s);
  while (!condition(heard())) {
    if (std::chrono::steady_clock::now() >= deadline) {
      tell_what_was_heard();
      return false;
    }
    std::this_thread::sleep_for(kPoll);
  }
  return true;
}

bool BusListener::until_more(uint32_t identifier, int count) {
  const auto number = [identifier](const Heard& heard) {
    const auto found = heard.frames.find(identifier);
    return found == heard.frames.end() ? 0 : found->second;
  };
  const int wanted = number(heard()) + count;
  return until([&](const Heard& heard) { return number(heard) >= wanted; });
}

void BusListener::tell_what_was_heard() const {
  const Heard heard = this->heard();
  std::ostringstream text;
  text << std::hex << "what was waited for on the bus did not come; frames so far by identifier:";
  for (const auto& [identifier, count] : heard.frames)
    text << " 0x" << identifier << ": " << std::dec << count << std::hex << ",";
  text << std::dec << " positions:";
  for (const auto& [node, feedback] : heard.feedback)
    text << " node " << node << " at " << feedback.position << " counts,";
  UNSCOPED_INFO(text.str());
}

std::optional<uint32_t> BusListener::read(int node, hal::ObjectAddress object) {
  {
    const std::lock_guard lock(mutex_);
    heard_.answer.erase(node);
    bus_->send(hal::encode_sdo_request(node, {hal::SdoRequest::Kind::kRead, object, 0, 0}));
  }
  if (!until([node](const Heard& heard) { return heard.answer.contains(node); })) return std::nullopt;
  return heard().answer.at(node);
}

}  // namespace tendril::app
