// SPDX-License-Identifier: Apache-2.0
#include "tools/tendril_latency_machine.h"

#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <string>

namespace tendril::tools {
namespace {

using nlohmann::ordered_json;

/// The first line of a file; null where there is none.
ordered_json first_line(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  return std::getline(file, line) ? ordered_json(line) : ordered_json(nullptr);
}

/// PREEMPT_RT, PREEMPT_DYNAMIC, ... out of uname's version; what is in force of a dynamic one only root may
/// see.
ordered_json preemption(const std::string& version) {
  std::istringstream words(version);
  std::string word, found;
  while (words >> word)
    if (word.starts_with("PREEMPT")) found += (found.empty() ? "" : " ") + word;
  const ordered_json modes = first_line("/sys/kernel/debug/sched/preempt");  // "none voluntary (full)"
  if (modes.is_string()) {
    const auto text = modes.get<std::string>();
    const auto begin = text.find('('), end = text.find(')');
    if (begin < end && end != std::string::npos) found += ", " + text.substr(begin + 1, end - begin - 1);
  }
  return found.empty() ? ordered_json("none") : ordered_json(found);
}

ordered_json cpu_model() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  return nullptr;
}

bool in_virtual_machine() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("flags")) return line.find(" hypervisor") != std::string::npos;
  return false;
}

}  // namespace

ordered_json describe_machine(int cpu) {
  const std::string folder = "/sys/devices/system/cpu/cpu" + std::to_string(std::max(cpu, 0));
  utsname kernel{};
  uname(&kernel);
  ordered_json machine;
  machine["kernel"] = std::string(kernel.release) + " " + kernel.version;
  machine["command_line"] = first_line("/proc/cmdline");
  machine["preemption"] = preemption(kernel.version);
  machine["cpu"] = cpu_model();
  machine["cpus"] = sysconf(_SC_NPROCESSORS_ONLN);
  machine["virtual_machine"] = in_virtual_machine();
  machine["governor"] = first_line(folder + "/cpufreq/scaling_governor");
  machine["isolated_cpus"] = first_line("/sys/devices/system/cpu/isolated");
  machine["cpus_of_the_core"] = first_line(folder + "/topology/thread_siblings_list");
  machine["clock_source"] = first_line("/sys/devices/system/clocksource/clocksource0/current_clocksource");
  machine["rt_runtime_us"] = first_line("/proc/sys/kernel/sched_rt_runtime_us");
  return machine;
}

}  // namespace tendril::tools
