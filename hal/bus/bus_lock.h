// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace tendril::hal {

/// Makes this process the only controller of a bus on this machine, as long as the object lives. Two that
/// start at the same moment would not hear each other on the bus before both command the drives. The lock is
/// a name of the kernel's (an abstract socket), which goes with the process however it ends. Like an
/// interface it belongs to a network namespace. Real-time: no (system calls).
class BusLock {
 public:
  /// @param bus  as for open_bus()
  /// @throws BusError with the other process where there is one
  explicit BusLock(const std::string& bus);
  ~BusLock();
  BusLock(const BusLock&) = delete;
  BusLock& operator=(const BusLock&) = delete;

 private:
  int socket_;
};

}  // namespace tendril::hal
