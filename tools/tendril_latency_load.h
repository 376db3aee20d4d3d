#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace tendril::tools {

/// Names of the loads: cpu, memory, disk, faults.
std::vector<std::string> load_names();

/// Work that gets in the way of others for as long as it lives: stress-ng in a process of its own, a worker
/// of each load on every CPU, one of them for the disk.
class LatencyLoad {
 public:
  /// @param names  of load_names(); none: no load
  /// @throws std::runtime_error where stress-ng cannot be started
  explicit LatencyLoad(const std::vector<std::string>& names);
  ~LatencyLoad();
  LatencyLoad(const LatencyLoad&) = delete;
  LatencyLoad& operator=(const LatencyLoad&) = delete;

  /// Whether stress-ng still runs; true where no load was asked for.
  bool alive();

 private:
  pid_t child_ = -1;
};

}  // namespace tendril::tools
