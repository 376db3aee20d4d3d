// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <string>
#include <thread>
#include <vector>

namespace tendril::tools {

/// Names of the loads: unmap, cpu, memory, disk, faults.
std::vector<std::string> load_names();

/// Work that gets in the way of others for as long as it lives: stress-ng in a process of its own, a worker
/// of each load on every CPU, one of them for the disk; and unmap, a thread of this process that maps, fills
/// and unmaps memory all the time, as a heap does that is not told to keep what it has: at each unmapping the
/// kernel interrupts the CPUs of the process' other threads, which must forget the addresses.
class LatencyLoad {
 public:
  /// @param names  of load_names(); none: no load
  /// @param cpu    the only one that the load may use; -1: those of the caller, which isolcpus keeps off
  /// isolated ones
  /// @throws std::runtime_error where stress-ng cannot be started; rt::RtError where there is no such CPU
  explicit LatencyLoad(std::vector<std::string> names, int cpu = -1);
  ~LatencyLoad();
  LatencyLoad(const LatencyLoad&) = delete;
  LatencyLoad& operator=(const LatencyLoad&) = delete;

  /// Whether stress-ng still runs; true where none was asked for.
  bool alive();

 private:
  void start_stress(const std::vector<std::string>& names, int cpu);

  pid_t child_ = -1;
  std::jthread unmapper_;
};

}  // namespace tendril::tools
