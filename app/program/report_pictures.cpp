#include "app/program/report_pictures.h"

#include <spawn.h>
#include <spdlog/spdlog.h>
#include <sys/wait.h>

#include <cerrno>
#include <string>
#include <system_error>

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

}  // namespace

void draw_report(const std::filesystem::path& directory) {
  std::string tool = report_tool(), folder = directory.string();
  char* arguments[] = {tool.data(), folder.data(), nullptr};
  pid_t child = 0;
  int status = -1;
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  take_signals_as_usual(attributes);
  if (posix_spawn(&child, tool.c_str(), nullptr, &attributes, arguments, environ) == 0)
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
  posix_spawnattr_destroy(&attributes);
  if (status != 0)
    spdlog::warn("no pictures: '{} {}' failed; python3-matplotlib draws them, then type it again", tool,
                 folder);
}

}  // namespace tendril::app
