#include "app/robot/model_thread.h"

#include <pthread.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "rt/periodic_clock.h"
#include "rt/thread.h"

namespace tendril::app {
namespace {

constexpr auto kRetryInterval = std::chrono::milliseconds(1);
constexpr auto kLongestRest = std::chrono::milliseconds(20);  // before it looks whether it shall end
// After so many failed refreshes without a single good one there will be no first snapshot.
constexpr uint64_t kFailuresAllowed = 100;

}  // namespace

ModelThread::ModelThread(const Robot& robot, const Config& config, rt::Channels& channels)
    : refresher_(robot, config),
      channels_(channels),
      rate_limit_hz_(config.control.model_rate_limit_hz),
      thread_([this] { run(); }) {
  pthread_setname_np(thread_.native_handle(), "model");
  try {
    rt::keep_to_cpu(thread_.native_handle(), "model", config.control.model_cpu);
  } catch (...) {
    stop();
    throw;
  }
}

ModelThread::~ModelThread() { stop(); }

void ModelThread::stop() {
  quit_ = true;
  if (thread_.joinable()) thread_.join();
}

double ModelThread::mean_rate_hz() const {
  const int64_t active_ns =
      last_ns_.load(std::memory_order_relaxed) - first_ns_.load(std::memory_order_relaxed);
  return active_ns > 0 ? 1e9 * static_cast<double>(refreshes()) / static_cast<double>(active_ns) : 0;
}

/// Waits for the drives' displacements and brings the body to rest there.
bool ModelThread::settle() {
  while (!quit_) {
    const rt::Feedback& feedback = channels_.feedback.latest();
    if (feedback.displacements_known) {
      if (refresher_.settle(feedback.delta_a)) return true;
      channels_.requests.model_failed = true;
      return false;
    }
    std::this_thread::sleep_for(kRetryInterval);
  }
  return false;
}

void ModelThread::run() {
  try {
    if (settle()) refresh();
  } catch (const std::exception& error) {  // out of memory
    spdlog::error("the model thread ended: {}", error.what());
    channels_.requests.model_failed = true;
  }
}

void ModelThread::refresh() {
  first_ns_ = rt::now_ns();
  last_ns_ = first_ns_.load();
  const int64_t period_ns = rate_limit_hz_ > 0 ? std::llround(1e9 / rate_limit_hz_) : 0;
  while (!quit_) {
    const int64_t begin_ns = rt::now_ns();
    if (refresher_.refresh(channels_.feedback.latest(), begin_ns, channels_.snapshots.back())) {
      channels_.snapshots.publish();
      ++refreshes_;
    } else {
      ++failures_;  // the last good snapshot serves until its age limit
      if (refreshes_ == 0 && failures_ >= kFailuresAllowed) channels_.requests.model_failed = true;
      std::this_thread::sleep_for(kRetryInterval);
    }
    last_ns_ = rt::now_ns();
    rest_until(begin_ns + period_ns);
  }
}

/// In steps, as it may be asked to end meanwhile.
void ModelThread::rest_until(int64_t instant_ns) {
  for (int64_t left_ns; !quit_ && (left_ns = instant_ns - rt::now_ns()) > 0;)
    std::this_thread::sleep_for(
        std::min(std::chrono::nanoseconds(left_ns), std::chrono::nanoseconds(kLongestRest)));
}

}  // namespace tendril::app
