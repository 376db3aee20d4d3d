// SPDX-License-Identifier: Apache-2.0
#include "app/program/report_pictures.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <spdlog/spdlog.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <thread>
#include <vector>

#include "app/program/stop_signal.h"

extern char** environ;

namespace tendril::app {

namespace {

constexpr auto kLookAtDrawing = std::chrono::milliseconds(10);

/// Of an installed program the one that was installed with it; else that of the source tree.
std::string report_tool() {
  std::error_code untold;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", untold);
  const auto installed = program.parent_path().parent_path() / TENDRIL_INSTALLED_REPORT_TOOL;
  return std::filesystem::exists(installed, untold) ? installed.string() : TENDRIL_REPORT_TOOL;
}

/// A process of the tool.
class Tool {
 public:
  /// Starts it.
  /// @param input  descriptor that becomes its standard input
  /// @param apart  whether what is typed at the terminal, such as Ctrl-C, is for us alone
  Tool(std::vector<std::string> words, bool apart, int input = STDIN_FILENO) {
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    if (apart) posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
    take_signals_as_usual(attributes);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, input, STDIN_FILENO);
    if (posix_spawn(&child_, arguments[0], &actions, &attributes, arguments.data(), environ) != 0)
      child_ = -1;
    posix_spawn_file_actions_destroy(&actions);
    posix_spawnattr_destroy(&attributes);
  }

  /// Whether it has ended.
  bool ended() { return child_ < 0 || reap(WNOHANG); }

  /// Waits for its end.
  /// @return  whether it did what it was asked
  bool did_it() {
    while (child_ >= 0 && !reap(0)) {
    }
    return status_ == 0;
  }

  void kill() { ::kill(child_, SIGKILL); }

 private:
  bool reap(int options) {
    const pid_t ended = ::waitpid(child_, &status_, options);
    if (ended == 0 || (ended < 0 && errno == EINTR)) return false;
    child_ = -1;
    return true;
  }

  pid_t child_ = -1;
  int status_ = -1;
};

/// A word as a shell takes it.
std::string quoted(const std::string& word) {
  constexpr std::string_view kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789/._-+=:,@%";
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) return word;
  std::string text = "'";
  for (const char letter : word) text += letter == '\'' ? std::string("'\\''") : std::string(1, letter);
  return text + "'";
}

/// Leaves no file that was not there.
void check_writable(const std::filesystem::path& file) {
  std::error_code untold;
  const bool was_there = std::filesystem::exists(file, untold);
  if (!std::ofstream(file, std::ios::app))
    throw std::runtime_error(fmt::format("cannot write {}: {}; name a file in a folder that can be written",
                                         file.string(), std::strerror(errno)));
  if (!was_there) std::filesystem::remove(file, untold);
}

/// A file in memory, which has no name and needs no folder.
class MemoryFile {
 public:
  explicit MemoryFile(const std::string& content) : descriptor_(memfd_create("tendril", MFD_CLOEXEC)) {
    std::size_t written = 0;
    while (written < content.size()) {
      const ssize_t more = ::write(descriptor_, content.data() + written, content.size() - written);
      if (more < 0 && errno == EINTR) continue;
      if (more <= 0)
        throw std::runtime_error(fmt::format("no memory for a picture: {}", std::strerror(errno)));
      written += static_cast<std::size_t>(more);
    }
    ::lseek(descriptor_, 0, SEEK_SET);
  }
  ~MemoryFile() { ::close(descriptor_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  int descriptor() const { return descriptor_; }

 private:
  int descriptor_;
};

}  // namespace

void draw_report(const std::filesystem::path& directory) {
  const std::string tool = report_tool(), folder = directory.string();
  const std::string command = quoted(tool) + " " + quoted(folder);
  const int signals_before = stop_signals();
  Tool drawing({tool, folder}, true);
  while (!drawing.ended()) {
    if (stop_signals() > signals_before) {
      drawing.kill();
      drawing.did_it();
      spdlog::warn("no pictures: a signal ended the drawing; the figures are whole, and this draws them: {}",
                   command);
      return;
    }
    std::this_thread::sleep_for(kLookAtDrawing);
  }
  if (!drawing.did_it())
    spdlog::warn("no pictures: python3-matplotlib draws them; install it, then type: {}", command);
}

void draw_robot(const std::string& geometry, const std::filesystem::path& file) {
  check_writable(file);
  const MemoryFile input(geometry);
  if (!Tool({report_tool(), "--robot", file.string()}, false, input.descriptor()).did_it())
    throw std::runtime_error(
        fmt::format("{} is not drawn: {} failed; install python3-matplotlib, which draws it", file.string(),
                    report_tool()));
}

}  // namespace tendril::app
