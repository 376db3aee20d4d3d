// SPDX-License-Identifier: Apache-2.0
#include <sched.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>

#include "app/daemon/service_manager.h"
#include "tests/app/daemon/bus_listener.h"
#include "tests/app/daemon/notify_socket.h"
#include "tests/app/program/frozen_thread.h"
#include "tests/app/program/programs.h"

// What systemd hears of the daemon.

namespace tendril::app::service_test {

constexpr int64_t kMillisecond = 1'000'000;
constexpr const char* kWatchdog = "WATCHDOG=1";

/// The daemon as systemd starts it, with a watchdog that wants to be fed each 100 ms.
class Service {
 public:
  explicit Service(std::vector<std::string> daemon) : process_(started(std::move(daemon))) {}

  Process& process() { return process_; }
  pid_t pid() const { return pid_; }

  /// Listens until a message comes that starts, and ends, like that. The test fails where patience ends
  /// before, though others go on coming.
  /// @return  all that came up to it, the message included
  std::vector<std::string> until(const std::string& start, const std::string& end = {}) {
    using Clock = std::chrono::steady_clock;
    const auto deadline = Clock::now() + std::chrono::duration<double>(kPatience_s);
    std::vector<std::string> texts;
    bool came = false;
    while (!came) {
      const std::chrono::duration<double> left = deadline - Clock::now();
      const auto message = socket_.next(std::max(0.0, left.count()));
      if (!message || left.count() < 0) break;
      if (pid_ == 0) pid_ = message->sender;
      CHECK(message->sender == pid_);  // NotifyAccess=main
      texts.push_back(message->text);
      came = message->text.starts_with(start) && message->text.ends_with(end);
    }
    INFO("waited for '" << start << "..." << end << "'; " << texts.size()
                        << " other messages came, the last '" << (texts.empty() ? "" : texts.back())
                        << "'; the daemon said:\n"
                        << process_.err());
    REQUIRE(came);
    return texts;
  }

  /// Forgets what has come so far: what is heard next comes after what was done before.
  void forget() {
    while (socket_.next(0)) {
    }
  }

 private:
  std::vector<std::string> started(std::vector<std::string> daemon) const {
    daemon.insert(daemon.begin(), {"env", "NOTIFY_SOCKET=" + socket_.address(), "WATCHDOG_USEC=200000"});
    return daemon;
  }

  NotifySocket socket_;
  Process process_;
  pid_t pid_ = 0;
};

auto count(const std::vector<std::string>& texts, const std::string& text) {
  return std::ranges::count(texts, text);
}

/// Sets variables of the environment until the end of its scope.
class Environment {
 public:
  explicit Environment(std::vector<std::pair<std::string, std::string>> variables)
      : variables_(std::move(variables)) {
    for (const auto& [name, value] : variables_) setenv(name.c_str(), value.c_str(), 1);
  }
  ~Environment() {
    for (const auto& [name, value] : variables_) unsetenv(name.c_str());
  }

 private:
  std::vector<std::pair<std::string, std::string>> variables_;
};

std::vector<int> allowed_cpus() {
  cpu_set_t allowed;
  REQUIRE(sched_getaffinity(0, sizeof allowed, &allowed) == 0);
  std::vector<int> cpus;
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu)
    if (CPU_ISSET(cpu, &allowed)) cpus.push_back(cpu);
  return cpus;
}

/// The CPUs that the kernel lets a thread run on, as in "0-3,7".
std::string cpus_of(pid_t thread) {
  constexpr std::string_view kKey = "Cpus_allowed_list:\t";
  for (const std::string& line : lines_of(read_text_file("/proc/" + std::to_string(thread) + "/status")))
    if (line.starts_with(kKey)) return line.substr(kKey.size());
  return "";
}

TEST_CASE("ServiceManager feeds the watchdog twice in its time, and only while cycles go on", "[unit]") {
  NotifySocket socket;
  const Environment environment({{"NOTIFY_SOCKET", socket.address()}, {"WATCHDOG_USEC", "100000"}});
  ServiceManager service;
  std::vector<int64_t> fed_ms;
  for (int64_t ms = 0; ms < 500; ++ms) {
    const int64_t cycles = std::min<int64_t>(ms, 220) + std::max<int64_t>(0, ms - 430);
    service.feed_watchdog(ms * kMillisecond, cycles);
    if (const auto message = socket.next(0)) {
      CHECK(message->text == kWatchdog);
      fed_ms.push_back(ms);
    }
  }
  CHECK(fed_ms == std::vector<int64_t>{1, 51, 101, 151, 201, 251, 431, 481});
}

TEST_CASE("ServiceManager feeds no watchdog where there is none, or where it is another process's",
          "[unit]") {
  NotifySocket socket;
  const bool of_another = GENERATE(false, true);
  CAPTURE(of_another);
  std::vector<std::pair<std::string, std::string>> variables{{"NOTIFY_SOCKET", socket.address()}};
  if (of_another) {
    variables.emplace_back("WATCHDOG_USEC", "100000");
    variables.emplace_back("WATCHDOG_PID", "1");
  }
  const Environment environment(variables);
  ServiceManager service;
  service.feed_watchdog(1000 * kMillisecond, 1000);
  service.ready();
  CHECK(socket.next().value().text == "READY=1");
}

TEST_CASE("The daemon is ready no sooner than its drives follow, and says when it stops", "[scenario]") {
  Workbench bench;
  bench.plant().send(SIGSTOP);  // drives that are switched on late
  Service service(bench.daemon());
  for (int meal = 0; meal < 5; ++meal) CHECK(count(service.until(kWatchdog), "READY=1") == 0);
  CHECK_THAT(service.until("STATUS=").back(), Catch::StartsWith("STATUS=connect, "));
  bench.plant().send(SIGCONT);
  service.until("READY=1");
  CHECK(service.process().says("phase: run", 0));
  service.until(kWatchdog);
  service.until("STATUS=run, ");

  service.process().send(SIGTERM);
  CHECK(count(service.until("STOPPING=1"), "READY=1") == 0);
  CHECK(service.process().wait() == 0);
}

TEST_CASE("The daemon says that it stops where it never was ready", "[scenario]") {
  Workbench bench;
  bench.plant().send(SIGSTOP);
  Service service(bench.daemon());
  service.until(kWatchdog);
  service.process().send(SIGTERM);
  CHECK(count(service.until("STOPPING=1"), "READY=1") == 0);
}

TEST_CASE("Each thread keeps to the CPU that the robot file gives it", "[scenario]") {
  const std::vector<int> cpus = allowed_cpus();
  const std::string first = std::to_string(cpus.front()), last = std::to_string(cpus.back());
  Workbench bench(Changes{
      {"priority: 80", "cpu: " + first + "\n  model_cpu: " + last + "\n  housekeeping_cpu: " + first}});
  Service service(bench.daemon());
  service.until("READY=1");
  CHECK(cpus_of(thread_of(service.pid(), "control")) == first);
  CHECK(cpus_of(thread_of(service.pid(), "model")) == last);
  CHECK(cpus_of(service.pid()) == first);
}

TEST_CASE("A model thread that hangs does not stop the watchdog from being fed", "[scenario]") {
  Workbench bench;
  Service service(bench.daemon());
  service.until("READY=1");
  const auto model = FrozenThread::freeze(thread_of(service.pid(), "model"));
  if (!model) {
    WARN("skipped: the kernel does not let a test stop a thread (ptrace)");
    return;
  }
  service.forget();
  for (int meal = 0; meal < 20; ++meal) service.until(kWatchdog);
  service.until("STATUS=", "model 0 Hz");
}

TEST_CASE(
    "A control thread that hangs stops the watchdog from being fed, and the next daemon holds what it finds",
    "[scenario]") {
  Changes changes = kSoonMissed;
  changes.emplace_back("waypoints: [5 0 0 mm, -5 0 0 mm]", "waypoints: [5 0 0 mm]");
  Workbench bench(changes);
  {
    Service service(bench.daemon());
    service.until("READY=1");
    BusListener listener(bench.bus(), {1});
    REQUIRE(listener.until([](const Heard& heard) {  // the finger is bent: there is something to hold
      const auto right = heard.feedback.find(1);
      return right != heard.feedback.end() && std::abs(right->second.position) > 1000;
    }));
    const auto control = FrozenThread::freeze(thread_of(service.pid(), "control"));
    if (!control) {
      WARN("skipped: the kernel does not let a test stop a thread (ptrace)");
      return;
    }
    service.forget();
    const std::string stands_still = "STATUS=the control thread stands still";
    service.until(stands_still);
    for (int second = 0; second < 2; ++second) CHECK(count(service.until(stands_still), kWatchdog) == 0);
    service.process().send(SIGABRT);  // systemd's WatchdogSignal=
  }
  const Ended next =
      run(without_pictures(bench.daemon({"--duration", "0.2", "--report", bench.report().string()})));
  INFO(next.err);
  REQUIRE(next.code == 0);
  const Trace trace = read_trace(bench.report());
  int held = 0;
  for (std::size_t row = 0; row < trace.rows.size(); ++row) {
    if (trace.cell(row, "phase") != "enable") continue;
    const double measured_m = trace.number(row, "displacement_right_m");
    CHECK(std::abs(measured_m) > 0.1e-3);
    CHECK(trace.number(row, "command_right_m") == Approx(measured_m).margin(1e-6));
    ++held;
  }
  CHECK(held > 0);
}

}  // namespace tendril::app::service_test
