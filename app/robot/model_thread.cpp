// SPDX-License-Identifier: Apache-2.0
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
// After so many failed refreshes in a row while the drives have no torque, there will be no snapshot to start
// from.
constexpr uint64_t kFailuresAllowed = 100;

}  // namespace

ModelThread::ModelThread(const Robot& robot, const Config& config, rt::Channels& channels)
    : refresher_(robot, config),
      surface_(robot.model, config),
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

void ModelThread::run() {
  while (!quit_) {
    try {
      if (settle()) refresh();
    } catch (const std::exception& error) {  // out of memory
      spdlog::error("the model failed: {}", error.what());
    }
    if (quit_) return;
    channels_.requests.model_failed = true;
    while (!quit_ && channels_.requests.model_failed) std::this_thread::sleep_for(kLongestRest);
  }
}

/// Waits for the drives' displacements and brings the body to rest there.
bool ModelThread::settle() {
  while (!quit_) {
    const rt::Feedback& feedback = channels_.feedback.latest();
    if (feedback.displacements_known) return refresher_.settle(feedback.delta_a);
    std::this_thread::sleep_for(kRetryInterval);
  }
  return false;
}

/// Until the model has failed, or shall end.
void ModelThread::refresh() {
  last_ns_ = rt::now_ns();
  if (first_ns_ == 0) first_ns_ = last_ns_.load();
  const int64_t period_ns = rate_limit_hz_ > 0 ? std::llround(1e9 / rate_limit_hz_) : 0;
  for (uint64_t in_a_row = 0; !quit_;) {
    const int64_t begin_ns = rt::now_ns();
    const rt::Feedback& feedback = channels_.feedback.latest();
    if (refresher_.refresh(feedback, begin_ns, channels_.snapshots.back())) {
      channels_.snapshots.publish();
      ++refreshes_;
      in_a_row = 0;
      publish_surface(begin_ns);
    } else {
      ++failures_;  // the last good snapshot serves until its age limit
      if (++in_a_row >= kFailuresAllowed && !feedback.efforts_known) return;
      std::this_thread::sleep_for(kRetryInterval);
    }
    last_ns_ = rt::now_ns();
    rest_until(begin_ns + period_ns);
  }
}

/// As often as the main thread wants it. It costs nothing where nobody looks.
void ModelThread::publish_surface(int64_t now_ns) {
  rt::SurfaceChannel& channel = channels_.surface;
  const double wanted_hz = channel.wanted_hz.load(std::memory_order_relaxed);
  if (wanted_hz <= 0 || now_ns < surface_due_ns_) return;
  surface_due_ns_ = std::max<int64_t>(surface_due_ns_ + std::llround(1e9 / wanted_hz), now_ns);
  surface_.sample(refresher_.x(), now_ns, channel.surfaces.back());
  channel.surfaces.publish();
}

/// In steps, as it may be asked to end meanwhile.
void ModelThread::rest_until(int64_t instant_ns) {
  for (int64_t left_ns; !quit_ && (left_ns = instant_ns - rt::now_ns()) > 0;)
    std::this_thread::sleep_for(
        std::min(std::chrono::nanoseconds(left_ns), std::chrono::nanoseconds(kLongestRest)));
}

}  // namespace tendril::app
