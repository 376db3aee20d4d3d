#pragma once

#include <string>

namespace tendril::app {

/// What `tendrilctl jog` was told; quantities as a person types them, empty for the default.
struct JogOptions {
  std::string file, actuator;
  std::string by, speed, limit, lag;
  std::string bus;  ///< empty: the robot file's
  bool json = false;
  bool allow_non_rt = false;
};

/// Moves one axis over the bus as its only master, and tells how it goes.
/// @return  0 arrived; 1 ended otherwise
/// @throws ConfigError for a wrong option or file; BusError, rt::RtError
int run_jog(const JogOptions& options);

}  // namespace tendril::app
