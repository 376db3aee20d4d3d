// SPDX-License-Identifier: Apache-2.0
#include "rt/thread.h"

#include <sched.h>
#include <sys/prctl.h>
#include <sys/resource.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "rt/memory.h"
#include "rt/rt_error.h"

namespace tendril::rt {

namespace {

constexpr std::size_t kLeastStackBytes = 64 * 1024;
// Threads of the kernel that the others rely on, its watchdogs and migration, have 99.
constexpr int kHighestPriority = 98;
constexpr std::size_t kNameBytes = 15;  // of the kernel's 16 with the terminator, see prctl(PR_SET_NAME)

std::string fifo_refusal(const ThreadConfig& config) {
  rlimit limit{};
  getrlimit(RLIMIT_RTPRIO, &limit);
  const std::string priority = std::to_string(config.priority);
  return "cannot run thread '" + config.name + "' under SCHED_FIFO at priority " + priority +
         " (RLIMIT_RTPRIO is " + std::to_string(limit.rlim_cur) +
         "); grant CAP_SYS_NICE or an RLIMIT_RTPRIO of " + priority + " (systemd: LimitRTPRIO=" + priority +
         "; shell: an rtprio line in /etc/security/limits.conf; "
         "in a container, a real-time budget of its cgroup), or run with --allow-non-rt";
}

void check(const ThreadConfig& config) {
  if (config.name.empty() || config.name.size() > kNameBytes)
    throw std::invalid_argument("thread name '" + config.name + "' has " +
                                std::to_string(config.name.size()) + " bytes; the kernel takes 1 to 15");
  if (config.priority < 1 || config.priority > kHighestPriority)
    throw std::invalid_argument("thread '" + config.name + "' asks for SCHED_FIFO priority " +
                                std::to_string(config.priority) + "; give 1 to 98");
  if (config.stack_bytes < kLeastStackBytes)
    throw std::invalid_argument("thread '" + config.name + "' asks for a stack of " +
                                std::to_string(config.stack_bytes) + " bytes; give at least " +
                                std::to_string(kLeastStackBytes));
  if (config.cpu >= CPU_SETSIZE)
    throw std::invalid_argument("thread '" + config.name + "' asks for CPU " + std::to_string(config.cpu) +
                                "; give 0 to 1023, or -1 for any");
}

std::string cpu_refusal(const std::string& name, int cpu) {
  return "cannot run thread '" + name + "' on CPU " + std::to_string(cpu) +
         "; give one that exists and that the process may use (see `taskset -p`, systemd's CPUAffinity=)";
}

cpu_set_t only(int cpu) {
  cpu_set_t set;
  CPU_ZERO(&set);
  CPU_SET(cpu, &set);
  return set;
}

// pthread_attr_t owns memory of its own once it has an affinity.
class Attributes {
 public:
  Attributes() { require(pthread_attr_init(&attributes_)); }
  ~Attributes() { pthread_attr_destroy(&attributes_); }
  Attributes(const Attributes&) = delete;
  Attributes& operator=(const Attributes&) = delete;

  void stack(std::size_t bytes) { require(pthread_attr_setstacksize(&attributes_, bytes)); }

  void fifo(int priority) {
    // Without the first of these three, pthread_create ignores the other two.
    require(pthread_attr_setinheritsched(&attributes_, PTHREAD_EXPLICIT_SCHED));
    require(pthread_attr_setschedpolicy(&attributes_, SCHED_FIFO));
    const sched_param param{.sched_priority = priority};
    require(pthread_attr_setschedparam(&attributes_, &param));
  }

  void cpu(int cpu) {
    const cpu_set_t set = only(cpu);
    require(pthread_attr_setaffinity_np(&attributes_, sizeof set, &set));
  }

  const pthread_attr_t* get() const { return &attributes_; }

 private:
  // pthread calls return the error, a positive number, and leave errno alone.
  static void require(int error) {
    if (error != 0) throw RtError("cannot prepare a thread (" + std::string(std::strerror(error)) + ")");
  }
  pthread_attr_t attributes_;
};

// What is left of this thread's stack, less a few pages for the calls that touch the rest.
std::size_t stack_left() {
  constexpr std::uintptr_t kMargin = 16 * 1024;
  pthread_attr_t attributes;
  if (pthread_getattr_np(pthread_self(), &attributes) != 0) return 0;
  void* lowest = nullptr;
  std::size_t size = 0;
  pthread_attr_getstack(&attributes, &lowest, &size);
  pthread_attr_destroy(&attributes);
  const auto here = reinterpret_cast<std::uintptr_t>(__builtin_frame_address(0));
  const auto end = reinterpret_cast<std::uintptr_t>(lowest) + kMargin;
  return here > end ? here - end : 0;
}

}  // namespace

RealtimeThread::RealtimeThread(const ThreadConfig& config, RtRights rights, std::function<void()> body)
    : body_(std::move(body)), name_(config.name) {
  check(config);
  int error = create(config, true);
  if (error == EPERM) {
    refusal_ = fifo_refusal(config);
    if (rights == RtRights::kRequire) throw RtError(refusal_);
    error = create(config, false);
  }
  if (error == EINVAL && config.cpu >= 0) throw RtError(cpu_refusal(config.name, config.cpu));
  if (error != 0) throw RtError("cannot start thread '" + config.name + "' (" + std::strerror(error) + ")");
}

RealtimeThread::~RealtimeThread() { join(); }

void RealtimeThread::join() noexcept {
  if (!joined_) pthread_join(thread_, nullptr);
  joined_ = true;
}

int RealtimeThread::create(const ThreadConfig& config, bool fifo) {
  Attributes attributes;
  attributes.stack(config.stack_bytes);
  if (fifo) attributes.fifo(config.priority);
  if (config.cpu >= 0) attributes.cpu(config.cpu);
  return pthread_create(&thread_, attributes.get(), &RealtimeThread::enter, this);
}

void* RealtimeThread::enter(void* self) noexcept {
  auto& thread = *static_cast<RealtimeThread*>(self);
  pthread_setname_np(pthread_self(), thread.name_.c_str());
  // The kernel wakes threads without real-time priority up to 50 µs late to save power; those with it, never.
  prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);
  prefault_stack(stack_left());
  thread.body_();
  return nullptr;
}

void keep_to_cpu(pthread_t thread, const std::string& name, int cpu) {
  if (cpu < 0) return;
  const cpu_set_t set = only(cpu);
  if (pthread_setaffinity_np(thread, sizeof set, &set) != 0) throw RtError(cpu_refusal(name, cpu));
}

Scheduling scheduling_of_this_thread() noexcept {
  // The sched_ calls ask the kernel; pthread_getschedparam answers from what glibc remembers, and misses a
  // chrt from outside.
  sched_param param{};
  sched_getparam(0, &param);
  switch (sched_getscheduler(0) & ~SCHED_RESET_ON_FORK) {
    case SCHED_FIFO:
      return {"SCHED_FIFO", param.sched_priority};
    case SCHED_RR:
      return {"SCHED_RR", param.sched_priority};
    case SCHED_OTHER:
      return {"SCHED_OTHER", 0};
    case SCHED_BATCH:
      return {"SCHED_BATCH", 0};
    case SCHED_IDLE:
      return {"SCHED_IDLE", 0};
    default:
      return {"unknown", param.sched_priority};
  }
}

}  // namespace tendril::rt
