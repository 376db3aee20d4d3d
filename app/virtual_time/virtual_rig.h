// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <vector>

#include "app/plant/plant.h"
#include "app/robot/control_stack.h"
#include "app/robot/model_refresher.h"
#include "app/robot/motion.h"
#include "hal/bus/virtual_bus.h"
#include "hal/drive/drives.h"
#include "rt/deadline_grid.h"

namespace tendril::app {

/// What virtual time is free to choose; the rest is the configuration's.
struct VirtualSettings {
  double model_rate_hz = 60;  ///< refreshes; a snapshot is published one period after its pose was read
  /// Each period of the model is drawn evenly from those that differ by up to this share, below 1, from the
  /// mean.
  double model_jitter = 0;
  uint32_t jitter_seed = 1;
  /// One loop at the model's rate instead of two: the target is the one read at the instant of the pose, and
  /// the command that follows from both goes out when the refresh ends and stands still until the next one
  /// ends. [Largilliere 2015, section III: the generic method]
  bool synchronous = false;
  int64_t bus_delay_ns = 300'000;     ///< of every frame
  int64_t drive_period_ns = 250'000;  ///< how often the simulated drives look at the bus
  int64_t target_period_ns = 5'000'000;
  PlantDisplacements start{};  ///< where the drives stand at power-on
};

/// The whole of Tendril in one thread under a clock of its own: the control loop, the model, the drives and
/// the simulated robot that the daemon and tendril-plant are made of, each called at its instants in a fixed
/// order. The same configuration and settings give the same bits.
class VirtualRig {
 public:
  /// @throws ConfigError
  VirtualRig(const Config& config, const VirtualSettings& settings);
  VirtualRig(const VirtualRig&) = delete;
  VirtualRig& operator=(const VirtualRig&) = delete;

  /// Lets virtual time pass.
  /// @throws std::runtime_error where the simulated body cannot be advanced
  void run_for(double seconds);

  /// Lets it pass until the control loop has reached a phase or `seconds` have gone by.
  /// @return  true where the phase was reached
  bool run_until(rt::Phase phase, double seconds);

  int64_t now_ns() const { return now_ns_; }
  rt::Phase phase() const { return phase_; }
  const std::vector<rt::TraceRecord>& trace() const { return trace_; }  ///< every cycle so far
  const std::vector<PlantMeasurement>& measurements() const {
    return measurements_;
  }                                                                ///< after every time step
  const std::optional<Motion>& motion() const { return motion_; }  ///< once the controller runs
  /// Forgets the trace and the measurements so far, but for the last measurement, so that a long run needs no
  /// more memory than a short one.
  void forget_trace();

  /// As ControlStack::stop_reason().
  std::string stop_reason() const { return stack_.stop_reason(config_); }
  const fem::Mesh& mesh() const { return robot_->model.mesh(); }

  const rt::Controller& controller() const { return stack_.controller; }
  const hal::DriveMaster& master() const { return *stack_.master; }
  const hal::Measurement& measurement() const { return stack_.loop.measurement(); }  ///< of the last cycle
  PlantDisplacements displacements() const { return drives_.displacements(); }
  PlantEfforts efforts() const { return body_.efforts(); }  ///< of the body's last time step

  /// Heap calls made by the control loop's cycles so far; always 0 where they cannot be counted.
  int64_t heap_calls() const { return heap_calls_; }

  // What a scenario may do to it.
  PlantDrives& drives() { return drives_; }
  rt::Requests& requests() { return stack_.channels->requests; }
  hal::VirtualBus& bus() { return medium_; }
  hal::VirtualEndpoint& controller_plug() { return controller_bus_; }
  hal::VirtualEndpoint& plant_plug() { return plant_bus_; }
  void stall_model(bool stalled) { model_stalled_ = stalled; }
  void stall_targets(bool stalled) { targets_stalled_ = stalled; }
  void stall_control(bool stalled) { control_stalled_ = stalled; }
  void overrun_control(int cycles) { overruns_ = cycles; }  ///< the next so many end when the next is due
  void spoil_snapshots(bool spoilt) { snapshots_spoilt_ = spoilt; }  ///< with what is no number

  /// Called with every snapshot when it is published.
  void observe_snapshots(std::function<void(const rt::Snapshot&)> observer) {
    observer_ = std::move(observer);
  }

 private:
  using Task = void (VirtualRig::*)();
  struct Event {
    Task task;
    int64_t period_ns;
    int64_t next_ns;
  };

  void step();
  void move_body();
  void serve_drives();
  void refresh_model();
  int64_t next_model_period_ns();
  void publish_refresh();
  void begin_refresh();
  void send_target();
  void control();

  Config config_;
  VirtualSettings settings_;
  int64_t now_ns_;
  std::unique_ptr<Robot> robot_;
  hal::VirtualBus medium_;
  hal::VirtualEndpoint& controller_bus_;
  hal::VirtualEndpoint& plant_bus_;
  ControlStack stack_;
  ModelRefresher refresher_;
  PlantBody body_;
  PlantDrives drives_;
  rt::DeadlineGrid control_grid_;
  int64_t cycles_ = 0, heap_calls_ = 0;
  int overruns_ = 0, late_in_a_row_ = 0;
  std::vector<Event> events_;  // a tie is served in this order
  std::vector<rt::TraceRecord> trace_;
  rt::Phase phase_ = rt::Phase::kConnecting;  // of the last cycle
  std::vector<PlantMeasurement> measurements_;
  rt::EffectorVector rest_;  // where effectors that do not move stay
  std::optional<Motion> motion_;
  std::mt19937 jitter_;
  std::function<void(const rt::Snapshot&)> observer_;
  std::optional<rt::Target> step_target_;  // of the refresh under way, where there is one loop
  bool model_settled_ = false, snapshot_ready_ = false, refresh_due_ = false;
  bool model_stalled_ = false, targets_stalled_ = false, control_stalled_ = false;
  bool snapshots_spoilt_ = false;
};

}  // namespace tendril::app
