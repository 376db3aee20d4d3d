// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hal/drive/axis_scale.h"
#include "hal/sim/simulated_actuator.h"
#include "hal/sim/simulated_drive.h"

namespace tendril::hal {

/// A simulated drive of one protocol with its actuator: converts positions to displacements and efforts to
/// loads.
/// @tparam Drive  the simulated drive; has the functions called below
template <class Drive>
class SimulatedAxis final : public SimulatedDrive {
 public:
  /// @param heartbeat_id  identifier of the drive's heartbeats
  template <class Spec>
  SimulatedAxis(const Spec& spec, const AxisScale& scale, double force_limit, uint32_t heartbeat_id)
      : drive_(spec),
        scale_(scale),
        force_limit_(scale.reversed ? -force_limit : force_limit),
        heartbeat_id_(heartbeat_id) {}

  void receive(const Frame& frame, int64_t now_ns, FrameBatch& out) noexcept override {
    if (!silent_) return drive_.receive(frame, now_ns, out);
    answers_.clear();
    drive_.receive(frame, now_ns, answers_);
    pass_all_but_heartbeats(out);
  }
  void advance(int64_t now_ns, FrameBatch& out) noexcept override {
    if (!silent_) return drive_.advance(now_ns, out);
    answers_.clear();
    drive_.advance(now_ns, answers_);
    pass_all_but_heartbeats(out);
  }
  double displacement() const noexcept override { return scale_.to_displacement(drive_.position()); }
  void set_load(double effort) noexcept override { drive_.set_load(effort / force_limit_); }
  PowerStage power_stage() const noexcept override { return drive_.power_stage(); }
  void overheat() noexcept override { drive_.overheat(); }
  void inject_fault(uint32_t code) noexcept override { drive_.inject_fault(code); }
  void set_jammed(bool jammed) noexcept override { drive_.set_jammed(jammed); }
  void set_silent(bool silent) noexcept override { silent_ = silent; }

 private:
  void pass_all_but_heartbeats(FrameBatch& out) noexcept {
    for (const Frame& frame : answers_)
      if (frame.id != heartbeat_id_) out.push(frame);
  }

  Drive drive_;
  AxisScale scale_;
  double force_limit_;  // N or Pa, negative where displacement falls as the position rises
  uint32_t heartbeat_id_;
  bool silent_ = false;
  FrameBatch answers_;
};

}  // namespace tendril::hal
