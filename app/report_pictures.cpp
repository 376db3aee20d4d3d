#include "app/report_pictures.h"

#include <spawn.h>
#include <spdlog/spdlog.h>
#include <sys/wait.h>

#include <cerrno>
#include <string>

extern char** environ;

namespace tendril::app {

void draw_report(const std::filesystem::path& directory) {
  std::string tool = TENDRIL_REPORT_TOOL, folder = directory.string();
  char* arguments[] = {tool.data(), folder.data(), nullptr};
  pid_t child = 0;
  int status = -1;
  if (posix_spawn(&child, tool.c_str(), nullptr, nullptr, arguments, environ) == 0)
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
  if (status != 0)
    spdlog::warn("no pictures: '{} {}' failed; python3-matplotlib draws them, then type it again", tool,
                 folder);
}

}  // namespace tendril::app
