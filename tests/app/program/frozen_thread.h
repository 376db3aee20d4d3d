// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <memory>
#include <string>

namespace tendril::app {

/// The thread of a program under test that has a name, as `top -H` shows it.
/// @throws std::runtime_error where there is none
pid_t thread_of(pid_t process, const std::string& name);

/// A thread of a program under test that hangs: the kernel keeps it from running, as a debugger's breakpoint
/// does, while the other threads of its process go on. It goes on with the end of the object.
class FrozenThread {
 public:
  /// @param thread  of a child process
  /// @return  nothing where the kernel does not let us (ptrace)
  static std::unique_ptr<FrozenThread> freeze(pid_t thread);

  ~FrozenThread();
  FrozenThread(const FrozenThread&) = delete;
  FrozenThread& operator=(const FrozenThread&) = delete;

 private:
  explicit FrozenThread(pid_t thread) : thread_(thread) {}
  pid_t thread_;
};

}  // namespace tendril::app
