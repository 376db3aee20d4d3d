// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "hal/bus/bus.h"
#include "hal/canopen/canopen.h"
#include "hal/canopen/emergency.h"
#include "hal/canopen/sdo.h"
#include "hal/cia402/cia402.h"

namespace tendril::app {

/// What the bus has carried since the listener joined.
struct Heard {
  std::map<int, hal::DriveFeedback> feedback;        // the last of each node
  std::map<int, hal::DriveCommand> command;          // the last to each node
  std::map<int, std::vector<uint16_t>> emergencies;  // error codes of each node in order
  std::map<int, uint32_t> answer;                    // the last value each node answered over SDO
  std::map<uint32_t, int> frames;                    // how many there were of each identifier
};

/// A third node on a local bus, beside controller and drives: hears everything on a thread of its own, and
/// asks the drives over SDO where nobody else does.
class BusListener {
 public:
  /// @param nodes  the drives to hear
  /// @throws hal::BusError where nobody hosts the bus
  BusListener(const std::string& bus, std::vector<int> nodes);
  ~BusListener();

  /// Waits until a condition on what was heard holds. It is asked again and again, and may remember.
  /// @return  false where patience ended before: the test's next assertion then tells what was heard
  bool until(const std::function<bool(const Heard&)>& condition);

  Heard heard() const;

  /// Waits until so many more frames of an identifier have come: time, as its sender counts it.
  /// @return  false where patience ended before
  bool until_more(uint32_t identifier, int count);

  /// Reads an entry of a drive's object dictionary.
  /// @return  nothing where the drive does not answer
  std::optional<uint32_t> read(int node, hal::ObjectAddress object);

 private:
  void listen();
  void take_in(const hal::Frame& frame);
  void tell_what_was_heard() const;

  std::vector<int> nodes_;
  mutable std::mutex mutex_;  // of the bus and of what was heard
  std::unique_ptr<hal::Bus> bus_;
  Heard heard_;
  bool quit_ = false;
  std::thread thread_;
};

}  // namespace tendril::app
