// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/bus_input.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <memory>

#include "hal/sim/simulated_actuator.h"
#include "hal/sim/simulated_drive.h"
#include "tests/fuzz/bytes.h"
#include "tests/fuzz/frames.h"
#include "tests/fuzz/inputs.h"

namespace tendril::fuzz {
namespace {

using hal::Frame;
using hal::FrameBatch;

constexpr int64_t kMillisecond_ns = 1'000'000, kSecond_ns = 1'000'000'000;
constexpr int64_t kPeriod_ns = 2 * kMillisecond_ns;
constexpr double kTopRate = 0.2;  // m/s, of the simulated drives
constexpr double kRange = 0.05;   // m, either way

class Rig {
 public:
  Rig(const Language& language, const hal::MasterConfig& config)
      : language_(language),
        config_(config),
        master_(hal::make_master(config)),
        ids_(master_->identifiers()),
        says_enabled_(config.axes.size()),
        positions_(config.axes.size()) {
    command_.axes = static_cast<int>(config.axes.size());
    for (int axis = 0; axis < command_.axes; ++axis) {
      drives_.push_back(language.protocol->make_simulated_drive(config, axis,
                                                                {.top_rate = kTopRate,
                                                                 .displacement = 0.01 * axis,
                                                                 .displacement_range = 2 * kRange,
                                                                 .force_limit = 100}));
      positions_[axis] = drives_.back()->displacement();
    }
    // What the master sends, too: requests to a drive, NMT, and the answers of a second master.
    for (const uint32_t id : {0x000u, 0x601u, 0x602u, 0x5E1u, 0x021u, 0x027u, 0x02Cu, 0x02Du, 0x041u, 0x058u})
      ids_.push_back(id);
  }

  void step(Bytes& bytes) {
    const uint8_t step = bytes.byte();
    const int argument = step >> 3;
    switch (step & 7) {
      case 0:
        for (int k = 0; k <= argument; ++k) cycle();
        break;
      case 1:
        spread(frame_from(bytes, ids_), argument);
        break;
      case 2:
        damage_ = {.every = argument + 1, .at = bytes.byte(), .by = bytes.byte()};
        break;
      case 3:
        set_command(bytes.byte());
        break;
      case 4:
        pause((argument + 1) * 20 * kMillisecond_ns);
        break;
      case 5:
        harm(*drives_[argument % drives_.size()], bytes.byte());
        break;
      case 6:
        age_ns_ = argument * 5 * kMillisecond_ns;
        break;
      default:
        health_ = static_cast<hal::BusHealth>(argument & 3);
        master_alive_ = argument < 24;
        break;
    }
  }

  /// Whatever came before: the operator ends the run, and the drives are silent from now on.
  void end() {
    master_alive_ = true;
    health_ = hal::BusHealth::kActive;
    command_.enable = command_.reset = false;
    command_.finish = true;
    constexpr int64_t kStep_ns = 20 * kMillisecond_ns, kEnd_ns = 30 * kSecond_ns;
    for (int64_t t_ns = 0; t_ns < kEnd_ns && !measured_.finished; t_ns += kStep_ns) {
      now_ns_ += kStep_ns;
      run_master();
    }
    for (int a = 0; a < measured_.axes && !measured_.finished; ++a)
      must(measured_.power[a] != hal::DrivePower::kOn, "a silent drive is known to be out of reach");
  }

 private:
  /// Of the frames of the drives: each so many one is lost, or has another byte.
  struct Damage {
    int every = 0;       // 0: none
    int at = 0, by = 0;  // `by` 0: it is lost
  };

  void cycle() {
    now_ns_ += kPeriod_ns / 2;
    run_drives();
    now_ns_ += kPeriod_ns / 2;
    if (master_alive_) run_master();
  }

  void run_drives() {
    FrameBatch& out = batch_;
    out.clear();
    for (size_t axis = 0; axis < drives_.size(); ++axis) {
      drives_[axis]->advance(now_ns_, out);
      for (const Frame& frame : to_drives_) drives_[axis]->receive(frame, now_ns_, out);
      check_drive(axis);
    }
    to_drives_.clear();
    must(out.dropped() == 0, "the answers of drives fit a batch");
    for (const Frame& frame : out) {
      must(frame.length <= 8 && frame.id < 0x800 && !frame.extended, "drives send classic frames");
      arrive(frame);
    }
  }

  /// It moves no faster than it can, whatever it was told.
  void check_drive(size_t axis) {
    const double position = drives_[axis]->displacement();
    const double way =
        kTopRate * 1e-9 * static_cast<double>(now_ns_ - drives_seen_ns_[axis] + kMillisecond_ns);
    constexpr double kResolution = 1e-5;  // m
    must(std::isfinite(position), "a drive stands somewhere");
    must(std::abs(position - positions_[axis]) <= way + kResolution,
         "a drive is no faster than its top speed");
    positions_[axis] = position;
    drives_seen_ns_[axis] = now_ns_;
  }

  void run_master() {
    for (const Frame& frame : to_master_) {
      for (size_t axis = 0; axis < config_.axes.size(); ++axis)
        if (const auto says = language_.says_enabled(config_, config_.axes[axis], frame))
          says_enabled_[axis] = *says;
      master_->receive(frame, frame.stamp_ns);
    }
    to_master_.clear();
    measured_ = master_->measure(health_, now_ns_);
    check_measurement();
    if (holds_) command_.displacement = measured_.displacement;
    FrameBatch& out = batch_;
    out.clear();
    master_->command(command_, now_ns_, out);
    must(out.dropped() == 0, "what a master sends in a cycle fits a batch");
    for (const Frame& frame : out) check_sent(frame);
    std::ranges::copy(out, std::back_inserter(to_drives_));
    command_.reset = false;
  }

  void check_measurement() const {
    must(measured_.axes == command_.axes && measured_.stamp_ns == now_ns_, "a measurement is of now");
    for (int axis = 0; axis < measured_.axes; ++axis) {
      must(std::isfinite(measured_.displacement[axis]), "measured displacements are finite");
      must(measured_.displacement_stamp_ns[axis] <= now_ns_, "no position comes from the future");
      must(!measured_.all_enabled || says_enabled_[axis], "no axis is enabled but by its drive's word");
      must(!measured_.all_disabled || measured_.power[axis] != hal::DrivePower::kOn,
           "disabled is without power");
    }
    for (const double value : measured_.sensors.value)
      must(std::isfinite(value), "sensors read finite values");
    must(!master_->describe(measured_.fault).empty(), "a fault has words");
  }

  void check_sent(const Frame& frame) {
    must(frame.length <= 8 && !frame.extended && frame.id < 0x800, "a master sends classic frames");
    for (const hal::AxisConfig& axis : config_.axes) {
      must(was_enabled_ || !language_.asks_for_power(config_, axis, frame),
           "no drive is enabled without command");
      must(language_.is_finite(config_, axis, frame), "set-points are finite");
    }
  }

  /// @param to  who hears it
  void spread(Frame frame, int to) {
    if (to & 1) to_drives_.push_back(frame);
    if (!(to & 2)) arrive(frame);
  }

  void arrive(Frame frame) {
    frame.stamp_ns = std::max<int64_t>(1, now_ns_ - age_ns_);
    if (damage_.every > 0 && ++arrived_ % damage_.every == 0) {
      if (damage_.by == 0) return;
      frame.data[static_cast<size_t>(damage_.at % 8)] ^= static_cast<uint8_t>(damage_.by);
      if (damage_.at >= 0xF0) frame.length = static_cast<uint8_t>(damage_.by % 9);
    }
    to_master_.push_back(frame);
  }

  void set_command(uint8_t bits) {
    command_.enable = bits & 1;
    command_.reset = bits & 2;
    command_.finish = bits & 4;
    was_enabled_ = was_enabled_ || command_.enable;
    holds_ = !(bits & 0x70);
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
    constexpr std::array<double, 8> kPlaces = {0, 0.02, -0.02, 1, 1e30, -1e300, kNaN, INFINITY};
    command_.displacement.fill(kPlaces[bits >> 4 & 7]);
    command_.effort.fill(kPlaces[bits >> 5]);
  }

  /// Nothing is heard nor sent.
  void pause(int64_t duration_ns) {
    now_ns_ += duration_ns;
    run_drives();
    if (master_alive_) run_master();
  }

  static void harm(hal::SimulatedDrive& drive, uint8_t how) {
    const int size = how >> 3;
    switch (how & 7) {
      case 0:
        return drive.overheat();
      case 1:
        return drive.inject_fault(size + 1u);
      case 2:
        return drive.set_jammed(size & 1);
      case 3:
        return drive.set_silent(size & 1);
      default:
        return drive.set_load((size - 16) * 20.0);
    }
  }

  const Language& language_;
  hal::MasterConfig config_;
  std::unique_ptr<hal::DriveMaster> master_;
  std::vector<std::unique_ptr<hal::SimulatedDrive>> drives_;
  std::vector<uint32_t> ids_;
  std::vector<bool> says_enabled_;
  std::vector<double> positions_;
  std::array<int64_t, hal::kMaxAxes> drives_seen_ns_{};
  std::vector<Frame> to_master_, to_drives_;
  FrameBatch batch_;
  hal::Command command_;
  hal::Measurement measured_;
  hal::BusHealth health_ = hal::BusHealth::kActive;
  Damage damage_;
  bool master_alive_ = true, holds_ = true, was_enabled_ = false;
  int64_t now_ns_ = kPeriod_ns, age_ns_ = 0;
  int arrived_ = 0;
};

}  // namespace

hal::MasterConfig two_axes(const hal::DriveProtocol& protocol) {
  hal::MasterConfig config;
  config.protocol = &protocol;
  config.period_ns = kPeriod_ns;
  config.start_timeout_ns = kSecond_ns;
  config.enable_timeout_ns = 2 * kSecond_ns;
  for (const int node : {1, 2})
    config.axes.push_back(
        {.name = node == 1 ? "north" : "south",
         .node = node,
         .scale = {.counts_per_turn = 65536, .displacement_per_turn = 0.0628, .reversed = node == 2},
         .displacement_min = -kRange,
         .displacement_max = kRange,
         .top_rate = 0.1});
  config.sensors.push_back(
      {.name = "camera",
       .id = 0x1F0,
       .signals =
           {{.name = "tip_x", .start = 0, .length = 32, .type = hal::SignalType::kFloat, .unit = "m"},
            {.name = "tip_y", .start = 32, .length = 16, .type = hal::SignalType::kSigned, .unit = "m"}},
       .age = hal::Signal{.name = "age", .start = 48, .length = 16, .scale = 10e-6, .unit = "s"}});
  return config;
}

bool feed_bus(const Language& language, const std::string& bytes) {
  Bytes left(bytes);
  const std::vector<hal::MasterConfig> configs = language.configs();
  Rig rig(language, configs[left.byte() % configs.size()]);
  while (!left.empty()) rig.step(left);
  rig.end();
  return true;
}

}  // namespace tendril::fuzz
