// SPDX-License-Identifier: Apache-2.0
#include "app/daemon/sample_errors.h"

#include <algorithm>
#include <cmath>

#include "app/robot/robot.h"

namespace tendril::app {
namespace {

// Samples of sensors that are older than this when they arrive are not compared with the model.
constexpr int64_t kMemory_ns = 1'000'000'000;

}  // namespace

SampleErrors::SampleErrors(const Config& config)
    : config_(config),
      signals_(config),
      effector_coordinates_(static_cast<int>(effector_rows(config).size())) {}

void SampleErrors::add(const rt::TraceRecord& record, const Motion* motion) {
  tip_.reset();
  efforts_.clear();
  if (record.phase == rt::Phase::kRunning) {
    if (running_since_ns_ == 0) running_since_ns_ = record.intended_ns;
    recent_.push_back({record.intended_ns,
                       Eigen::Map<const Eigen::VectorXd>(record.desired.data(), effector_coordinates_),
                       Eigen::Map<const Eigen::VectorXd>(record.p_e.data(), effector_coordinates_),
                       Eigen::Map<const Eigen::VectorXd>(
                           record.lambda.data(), static_cast<Eigen::Index>(config_.actuators.size()))});
    while (recent_.front().stamp_ns < record.intended_ns - kMemory_ns) recent_.pop_front();
    compare_tip(record, motion);
    compare_efforts(record);
  }
  new_samples_.pass(record);
}

const SampleErrors::ModelPoint& SampleErrors::model_at(int64_t stamp_ns) const {
  return *std::min_element(recent_.begin(), recent_.end(), [&](const auto& a, const auto& b) {
    return std::abs(a.stamp_ns - stamp_ns) < std::abs(b.stamp_ns - stamp_ns);
  });
}

/// Once every coordinate that is measured is newer than when it counted last: each at its own instant, as
/// they may come from several sensors.
void SampleErrors::compare_tip(const rt::TraceRecord& record, const Motion* motion) {
  const int64_t since_ns = motion ? motion->path_start_ns() : running_since_ns_;
  double to_path = 0, to_model = 0;
  int64_t newest_ns = 0;
  bool any_new = false;
  std::array<int64_t, 3> stamps_ns = compared_ns_;
  for (std::size_t k = 0; k < signals_.tip_axes.size(); ++k) {
    const int axis = signals_.tip_axes[k];
    const auto& reading = signals_.tip[axis];
    if (!reading || config_.effectors[0].weights[k] <= 0) continue;
    const int64_t stamp_ns = record.sensors.stamp_ns[reading->sensor];
    if (stamp_ns <= compared_ns_[axis] || stamp_ns < since_ns) return;
    stamps_ns[axis] = stamp_ns;
    newest_ns = std::max(newest_ns, stamp_ns);
    any_new = any_new || new_samples_.has(record, *reading);
    const double measured = record.sensors.value[reading->signal];
    const auto row = static_cast<Eigen::Index>(k);
    const ModelPoint& model = model_at(stamp_ns);
    to_path += std::pow((motion ? motion->at(stamp_ns).position : model.desired)[row] - measured, 2);
    to_model += std::pow(model.p_e[row] - measured, 2);
  }
  if (!any_new) return;
  compared_ns_ = stamps_ns;
  tip_ = {newest_ns, std::sqrt(to_path), std::sqrt(to_model)};
}

void SampleErrors::compare_efforts(const rt::TraceRecord& record) {
  for (std::size_t a = 0; a < signals_.efforts.size(); ++a) {
    const auto& reading = signals_.efforts[a];
    if (!reading || !new_samples_.has(record, *reading)) continue;
    const int64_t stamp_ns = record.sensors.stamp_ns[reading->sensor];
    if (stamp_ns < running_since_ns_) continue;
    const double solved = model_at(stamp_ns).lambda[static_cast<Eigen::Index>(a)];
    efforts_.push_back({a, std::abs(record.sensors.value[reading->signal] - solved)});
  }
}

}  // namespace tendril::app
