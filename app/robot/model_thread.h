// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <thread>

#include "app/robot/model_refresher.h"
#include "app/robot/surface_sampler.h"
#include "rt/channels.h"

namespace tendril::app {

/// The model thread: once the drives have told their displacements, brings the body to rest there, then
/// refreshes and publishes snapshots as fast as it can, or as the configuration allows.
class ModelThread {
 public:
  /// Starts the thread. Keeps references to robot and channels.
  /// @throws rt::RtError where its CPU is not there
  ModelThread(const Robot& robot, const Config& config, rt::Channels& channels);
  /// Ends and joins it.
  ~ModelThread();
  ModelThread(const ModelThread&) = delete;
  ModelThread& operator=(const ModelThread&) = delete;

  /// Ends and joins it; what follows is then final.
  void stop();

  uint64_t refreshes() const { return refreshes_.load(std::memory_order_relaxed); }
  /// Refreshes that found no usable pose.
  uint64_t failures() const { return failures_.load(std::memory_order_relaxed); }
  /// Refreshes a second, from the first to the last; 0 before there are any.
  double mean_rate_hz() const;

 private:
  void run();
  bool settle();
  void refresh();
  void publish_surface(int64_t now_ns);
  void rest_until(int64_t instant_ns);

  ModelRefresher refresher_;
  SurfaceSampler surface_;
  int64_t surface_due_ns_ = 0;
  rt::Channels& channels_;
  double rate_limit_hz_;
  std::atomic<bool> quit_{false};
  std::atomic<uint64_t> refreshes_{0}, failures_{0};
  std::atomic<int64_t> first_ns_{0}, last_ns_{0};
  std::thread thread_;
};

}  // namespace tendril::app
