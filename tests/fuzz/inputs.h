// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>

/// The inputs from outside, and what takes each of them in. A function gives one input to that code. The code
/// must take it or refuse it as it says that it does, whatever the input holds.
namespace tendril::fuzz {

/// The code does with an input what it must never do.
struct BrokenLaw : std::logic_error {
  using std::logic_error::logic_error;
};

/// @throws BrokenLaw where it does not hold
inline void must(bool holds, const char* law) {
  if (!holds) throw BrokenLaw(law);
}

// Each returns whether the input was taken, false where it was refused.

// Files of meshes.
bool feed_msh(const std::string& bytes);
bool feed_vtu(const std::string& bytes);
bool feed_vtk(const std::string& bytes);

// What people write.
bool feed_robot_file(const std::string& bytes);
bool feed_plant_fault(const std::string& bytes);
bool feed_trajectory(const std::string& bytes);
bool feed_jog_options(const std::string& bytes);

// What other programs write to our sockets.
bool feed_request(const std::string& bytes);
bool feed_lines(const std::string& bytes);
bool feed_local_bus(const std::string& bytes);

// What stands on the bus.
bool feed_canopen_frame(const std::string& bytes);
bool feed_sdo(const std::string& bytes);
bool feed_cia402_bus(const std::string& bytes);
bool feed_odrive_bus(const std::string& bytes);

}  // namespace tendril::fuzz
