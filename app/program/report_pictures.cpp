#include "app/program/report_pictures.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <spdlog/spdlog.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <system_error>
#include <vector>

#include "app/program/stop_signal.h"

extern char** environ;

namespace tendril::app {

namespace {

/// Of an installed program the one that was installed with it; else that of the source tree.
std::string report_tool() {
  std::error_code untold;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", untold);
  const auto installed = program.parent_path().parent_path() / TENDRIL_INSTALLED_REPORT_TOOL;
  return std::filesystem::exists(installed, untold) ? installed.string() : TENDRIL_REPORT_TOOL;
}

/// Runs the tool to its end.
/// @param input  descriptor that becomes its standard input
/// @return       whether it did what it was asked
bool run_tool(std::vector<std::string> words, int input = STDIN_FILENO) {
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  pid_t child = 0;
  int status = -1;
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  take_signals_as_usual(attributes);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, input, STDIN_FILENO);
  if (posix_spawn(&child, arguments[0], &actions, &attributes, arguments.data(), environ) == 0)
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  return status == 0;
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
  if (!run_tool({tool, folder}))
    spdlog::warn("no pictures: '{} {}' failed; python3-matplotlib draws them, then type it again", tool,
                 folder);
}

void draw_robot(const std::string& geometry, const std::filesystem::path& file) {
  check_writable(file);
  const MemoryFile input(geometry);
  if (!run_tool({report_tool(), "--robot", file.string()}, input.descriptor()))
    throw std::runtime_error(
        fmt::format("{} is not drawn: {} failed; install python3-matplotlib, which draws it", file.string(),
                    report_tool()));
}

}  // namespace tendril::app
