// SPDX-License-Identifier: Apache-2.0
#include "app/virtual_time/virtual_rig.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "app/config/master_config.h"
#include "app/robot/inverse_statics.h"
#include "hal/drive/drive_protocol.h"
#include "rt/heap_guard.h"

namespace tendril::app {
namespace {

// Not zero: stamps of zero mean "never".
constexpr int64_t kVirtualStart_ns = 1'000'000'000;

// Places in the list of events.
constexpr std::size_t kModel = 2, kControl = 4;

int64_t period_ns(double rate_hz) { return std::llround(1e9 / rate_hz); }

/// In the one loop a command may go as far as the drives get in a period of that loop.
rt::ControllerConfig law(const Config& config, const VirtualSettings& settings) {
  rt::ControllerConfig result = controller_config(config);
  result.waits_after_fault = config.control.on_fault == OnFault::kWait;
  if (settings.synchronous) result.period_s = 1 / settings.model_rate_hz;
  return result;
}

}  // namespace

VirtualRig::VirtualRig(const Config& config, const VirtualSettings& settings)
    : config_(config),
      settings_(settings),
      now_ns_(kVirtualStart_ns),
      robot_(build_model(config)),
      medium_(settings.bus_delay_ns),
      controller_bus_(medium_.attach("controller")),
      plant_bus_(medium_.attach("plant")),
      stack_(law(config, settings), hal::make_master(master_config(config)), controller_bus_),
      refresher_(*robot_, config),
      body_(config, settings.start),
      drives_(config, settings.start),
      control_grid_(config.control.rate_hz, kVirtualStart_ns),
      rest_(effectors_at_rest(*robot_)),
      jitter_(settings.jitter_seed) {
  measurements_.push_back(body_.measurement(kVirtualStart_ns));
  events_ = {{&VirtualRig::move_body, body_.time_step_ns(), kVirtualStart_ns + body_.time_step_ns()},
             {&VirtualRig::serve_drives, settings.drive_period_ns, kVirtualStart_ns},
             {&VirtualRig::refresh_model, period_ns(settings.model_rate_hz), kVirtualStart_ns},
             {&VirtualRig::send_target, settings.target_period_ns, kVirtualStart_ns},
             {&VirtualRig::control, 0, kVirtualStart_ns}};  // its period is the grid's
}

void VirtualRig::run_for(double seconds) {
  const int64_t end_ns = now_ns_ + std::llround(1e9 * seconds);
  while (now_ns_ < end_ns) step();
}

void VirtualRig::forget_trace() {
  trace_.clear();
  measurements_.erase(measurements_.begin(), measurements_.end() - 1);  // the drives need the last one
}

bool VirtualRig::run_until(rt::Phase wanted, double seconds) {
  const int64_t end_ns = now_ns_ + std::llround(1e9 * seconds);
  while (now_ns_ < end_ns && phase() < wanted) step();
  return phase() >= wanted;
}

void VirtualRig::step() {
  auto& event = *std::min_element(events_.begin(), events_.end(),
                                  [](const Event& a, const Event& b) { return a.next_ns < b.next_ns; });
  now_ns_ = event.next_ns;
  medium_.set_time(now_ns_);
  event.next_ns += event.period_ns;
  (this->*event.task)();
}

void VirtualRig::move_body() {
  if (!body_.step(drives_.body_displacements(), config_.plant->time_step))
    throw std::runtime_error("the simulated body could not be advanced: a smaller plant.time_step may help");
  drives_.set_loads(body_.efforts());
  measurements_.push_back(body_.measurement(now_ns_));
}

void VirtualRig::serve_drives() { drives_.serve(plant_bus_, measurements_.back(), now_ns_); }

int64_t VirtualRig::next_model_period_ns() {
  const int64_t mean_ns = period_ns(settings_.model_rate_hz);
  if (settings_.model_jitter == 0) return mean_ns;
  const double drawn = static_cast<double>(jitter_()) / std::mt19937::max();  // the same with every library
  return std::llround(static_cast<double>(mean_ns) * (1 + settings_.model_jitter * (2 * drawn - 1)));
}

/// The one loop moves its model under the efforts that follow from what is published here: those of the next
/// control cycle, at whose end it begins to refresh.
void VirtualRig::refresh_model() {
  events_[kModel].next_ns = now_ns_ + next_model_period_ns();
  if (model_stalled_) return;
  publish_refresh();
  if (settings_.synchronous)
    refresh_due_ = true;
  else
    begin_refresh();
}

void VirtualRig::publish_refresh() {
  if (!snapshot_ready_) return;
  if (observer_) observer_(stack_.channels->snapshots.back());
  stack_.channels->snapshots.publish();
  snapshot_ready_ = false;
  if (!step_target_) return;
  stack_.channels->targets.back() = *step_target_;
  stack_.channels->targets.publish();
}

void VirtualRig::begin_refresh() {
  const rt::Feedback& feedback = stack_.channels->feedback.latest();
  if (!feedback.displacements_known) return;
  if (!model_settled_) {
    model_settled_ = refresher_.settle(feedback.delta_a);
    if (!model_settled_) stack_.channels->requests.model_failed = true;
  }
  snapshot_ready_ =
      model_settled_ && refresher_.refresh(feedback, now_ns_, stack_.channels->snapshots.back());
  if (snapshots_spoilt_) stack_.channels->snapshots.back().p_e_free.setConstant(std::nan(""));
  if (!settings_.synchronous || !motion_ || targets_stalled_) return;
  step_target_ = motion_->at(now_ns_);
  step_target_->until_ns = now_ns_;
}

void VirtualRig::send_target() {
  if (targets_stalled_ || !motion_ || settings_.synchronous || phase_ != rt::Phase::kRunning) return;
  stack_.channels->targets.back() = motion_->at(now_ns_);
  stack_.channels->targets.publish();
}

void VirtualRig::control() {
  const bool late = overruns_ > 0;
  cycles_ += late ? 2 : 1;
  events_[kControl].next_ns = control_grid_.deadline_ns(cycles_);
  if (control_stalled_) return;
  const rt::HeapGuard heap;
  const rt::TraceRecord& record = stack_.loop.cycle({now_ns_, now_ns_, late_in_a_row_});
  heap_calls_ += heap.calls();
  late_in_a_row_ = late ? late_in_a_row_ + 1 : 0;
  if (late) --overruns_;
  trace_.push_back(record);
  phase_ = record.phase;
  if (config_.motion && stack_.channels->run_starts.fresh())
    motion_.emplace(config_, rest_, stack_.channels->run_starts.latest());
  if (refresh_due_) begin_refresh();
  refresh_due_ = false;
}

}  // namespace tendril::app
