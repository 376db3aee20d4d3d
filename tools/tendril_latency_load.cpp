#include "tools/tendril_latency_load.h"

#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <map>
#include <stdexcept>

extern char** environ;

namespace tendril::tools {
namespace {

// 0 workers: as many as there are CPUs.
const std::map<std::string, std::vector<std::string>> kLoads{
    {"cpu", {"--cpu", "0"}},
    {"memory", {"--vm", "0", "--vm-bytes", "256M"}},
    {"disk", {"--hdd", "1", "--hdd-bytes", "256M"}},
    {"faults", {"--fault", "0"}},
};

}  // namespace

std::vector<std::string> load_names() {
  std::vector<std::string> names;
  for (const auto& [name, arguments] : kLoads) names.push_back(name);
  return names;
}

LatencyLoad::LatencyLoad(const std::vector<std::string>& names) {
  if (names.empty()) return;
  std::vector<std::string> words{"stress-ng", "--quiet", "--temp-path",
                                 std::filesystem::temp_directory_path().string()};
  for (const std::string& name : names)
    words.insert(words.end(), kLoads.at(name).begin(), kLoads.at(name).end());
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  // A group of its own, or Ctrl-C would end the load before the measurement.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  const int error = posix_spawnp(&child_, "stress-ng", nullptr, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  if (error != 0)
    throw std::runtime_error(std::string("no load: stress-ng: ") + std::strerror(error) +
                             "; install the package stress-ng");
}

LatencyLoad::~LatencyLoad() {
  if (child_ < 0) return;
  kill(-child_, SIGTERM);
  while (waitpid(child_, nullptr, 0) < 0 && errno == EINTR) {
  }
}

bool LatencyLoad::alive() {
  if (child_ < 0) return true;
  siginfo_t ended{};
  return waitid(P_PID, static_cast<id_t>(child_), &ended, WEXITED | WNOHANG | WNOWAIT) == 0 &&
         ended.si_pid == 0;
}

}  // namespace tendril::tools
