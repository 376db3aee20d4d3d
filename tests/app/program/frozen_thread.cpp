// SPDX-License-Identifier: Apache-2.0
#include "tests/app/program/frozen_thread.h"

#include <sys/ptrace.h>
#include <sys/wait.h>

#include <filesystem>
#include <stdexcept>

#include "tests/app/robot_file.h"

namespace tendril::app {
pid_t thread_of(pid_t process, const std::string& name) {
  const std::string tasks = "/proc/" + std::to_string(process) + "/task";
  for (const auto& task : std::filesystem::directory_iterator(tasks))
    if (read_text_file(task.path() / "comm") == name + "\n") return std::stoi(task.path().filename());
  throw std::runtime_error("process " + std::to_string(process) + " has no thread '" + name + "'");
}

std::unique_ptr<FrozenThread> FrozenThread::freeze(pid_t thread) {
  // Unlike PTRACE_ATTACH, no signal is sent, which would stop the whole process.
  if (ptrace(PTRACE_SEIZE, thread, nullptr, nullptr) != 0) return nullptr;
  ptrace(PTRACE_INTERRUPT, thread, nullptr, nullptr);
  waitpid(thread, nullptr, __WALL);
  return std::unique_ptr<FrozenThread>(new FrozenThread(thread));
}

FrozenThread::~FrozenThread() {
  // Where the process was killed meanwhile, it is not gone before its tracer has looked at the thread's end.
  if (ptrace(PTRACE_DETACH, thread_, nullptr, nullptr) != 0) waitpid(thread_, nullptr, __WALL);
}

}  // namespace tendril::app
