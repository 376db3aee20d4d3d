// SPDX-License-Identifier: Apache-2.0
#include "tools/tendril_latency_load.h"

#include <pthread.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <map>
#include <sstream>
#include <stdexcept>

#include "app/program/stop_signal.h"
#include "rt/thread.h"

extern char** environ;

namespace tendril::tools {
namespace {

constexpr const char* kUnmap = "unmap";
constexpr std::size_t kMapped = 1 << 20, kPage = 4096;

// Where files are on a disk: /tmp is in memory on many machines.
constexpr const char* kDiskFolder = "/var/tmp";

// stress-ng's; 0 workers: as many as there are CPUs.
const std::map<std::string, std::vector<std::string>> kLoads{
    {"cpu", {"--cpu", "0"}},
    {"memory", {"--vm", "0", "--vm-bytes", "256M"}},
    {"disk", {"--hdd", "1", "--hdd-bytes", "256M"}},
    {"faults", {"--fault", "0"}},
};

void unmap_until(std::stop_token quit) {
  while (!quit.stop_requested()) {
    void* memory = mmap(nullptr, kMapped, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) continue;
    for (std::size_t at = 0; at < kMapped; at += kPage) static_cast<volatile char*>(memory)[at] = 1;
    munmap(memory, kMapped);
  }
}

bool is_installed(const std::string& program) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path ? path : "/usr/bin");
  for (std::string folder; std::getline(folders, folder, ':');)
    if (access((folder + "/" + program).c_str(), X_OK) == 0) return true;
  return false;
}

}  // namespace

std::vector<std::string> load_names() {
  std::vector<std::string> names{kUnmap};
  for (const auto& [name, arguments] : kLoads) names.push_back(name);
  return names;
}

LatencyLoad::LatencyLoad(std::vector<std::string> names, int cpu) {
  if (const auto unmap = std::find(names.begin(), names.end(), kUnmap); unmap != names.end()) {
    names.erase(unmap);
    unmapper_ = std::jthread(unmap_until);
    pthread_setname_np(unmapper_.native_handle(), "load");
    rt::keep_to_cpu(unmapper_.native_handle(), "load", cpu);
  }
  if (!names.empty()) start_stress(names, cpu);
}

LatencyLoad::~LatencyLoad() {
  if (child_ < 0) return;
  kill(-child_, SIGTERM);
  while (waitpid(child_, nullptr, 0) < 0 && errno == EINTR) {
  }
}

void LatencyLoad::start_stress(const std::vector<std::string>& names, int cpu) {
  if (!is_installed("stress-ng"))
    throw std::runtime_error("no load: there is no stress-ng; install the package stress-ng");
  // setpriv makes the load end with this program, also where that is killed. stress-ng's own time-out would
  // be a day.
  std::vector<std::string> words{"setpriv",   "--pdeathsig", "TERM",        "stress-ng", "--quiet",
                                 "--timeout", "0",           "--temp-path", kDiskFolder};
  if (cpu >= 0) words.insert(words.end(), {"--taskset", std::to_string(cpu)});
  for (const std::string& name : names)
    words.insert(words.end(), kLoads.at(name).begin(), kLoads.at(name).end());
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  // A group of its own, or Ctrl-C would end the load before the measurement.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  app::take_signals_as_usual(attributes);
  const int error =
      posix_spawnp(&child_, words.front().c_str(), nullptr, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  if (error != 0)
    throw std::runtime_error(std::string("no load: ") + words.front() + ": " + std::strerror(error));
}

bool LatencyLoad::alive() {
  if (child_ < 0) return true;
  siginfo_t ended{};
  return waitid(P_PID, static_cast<id_t>(child_), &ended, WEXITED | WNOHANG | WNOWAIT) == 0 &&
         ended.si_pid == 0;
}

}  // namespace tendril::tools
