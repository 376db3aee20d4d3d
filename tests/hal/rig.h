#pragma once

#include <deque>
#include <functional>
#include <vector>

#include "hal/cia402_drive.h"
#include "hal/cia402_master.h"
#include "hal/virtual_bus.h"

namespace tendril::hal::test {

inline constexpr int64_t kPeriod_ns = 1'666'667;  // 600 Hz

/// A configuration of `axes` axes with nodes 1, 2, ... and names "axis 0"...
MasterConfig config_of(int axes);

/// A master and its drives on a virtual bus, with everything they say on record.
struct Rig {
  /// @param delay_ns  of every frame
  explicit Rig(MasterConfig config, int64_t delay_ns = 0);

  /// One control period: the master's cycle, then the drives' reaction.
  void cycle();

  /// Cycles until `done` or for at most that long. @return whether it was done
  bool run_until(const std::function<bool()>& done, int64_t limit_ns = 5'000'000'000);

  void run_for(int64_t duration_ns);

  /// Enables all drives at their measured positions. @return whether it worked
  bool enable();

  /// Index in `traffic` of the first frame at or after `from` with that text, or -1.
  int find(const std::string& text, int from = 0) const;

  VirtualBus bus;
  VirtualEndpoint& controller;
  VirtualEndpoint& recorder;
  std::vector<VirtualEndpoint*> plugs;  // of the drives
  Cia402Master master;
  std::vector<Cia402Drive> drives;
  Command command;
  Measurement measured;
  bool master_alive = true;
  bool follow_measured = true;                         // the command holds what is measured
  std::function<bool(int axis, Frame& frame)> tamper;  // with what drives send; false drops it
  std::vector<Frame> traffic;
  FrameBatch batch;
};

}  // namespace tendril::hal::test
