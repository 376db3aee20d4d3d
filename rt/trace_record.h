// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "rt/control_law.h"

namespace tendril::rt {

/// One cycle as the log keeps it: fixed size, plain data.
struct TraceRecord {
  int64_t intended_ns = 0;  ///< intended wake-up, CLOCK_MONOTONIC
  int64_t wakeup_ns = 0;    ///< actual wake-up after the intended one
  int64_t read_ns = 0;      ///< of the cycle's work: taking in what the bus has brought
  int64_t solve_ns = 0;     ///< of the cycle's work: snapshot, target, QP; what remains is writing
  int64_t cycle_ns = 0;     ///< from wake-up to the end of the cycle's work
  int bus_bits = 0;         ///< of the frames read and written, each with all stuff bits it can need
  int64_t missed = 0;       ///< deadlines skipped because this cycle ended late
  int64_t cycles = 0;       ///< deadlines that have passed since the loop began, missed ones included
  int64_t late_cycles = 0;  ///< of these, the missed ones
  int64_t heap_calls = 0;   ///< of the thread since the loop began; 0 where they cannot be counted
  int64_t page_faults = 0;  ///< of the thread since the loop began, minor and major
  Phase phase = Phase::kConnecting;
  FaultSet faults;
  LatchedFault latched;
  std::array<hal::DrivePower, kMaxActuators> power{};  ///< of the drives' power stages
  bool qp_solved = false;                              ///< whether a QP was posed
  qp::Status qp_status = qp::Status::kOptimal;
  int qp_iterations = 0;
  uint64_t snapshot_sequence = 0;  ///< 0: none yet
  int64_t snapshot_age_ns = 0;
  hal::SensorReadings sensors;
  std::array<double, kMaxActuators> command{};               ///< δ_a commanded, m or m³
  std::array<double, kMaxActuators> measured{};              ///< δ_a measured, m or m³
  std::array<double, kMaxActuators> lambda{};                ///< N or Pa
  std::array<double, kMaxEffectorCoordinates> desired{};     ///< m or m³
  std::array<double, kMaxEffectorCoordinates> p_e{};         ///< the model's, corrected by sensors, m or m³
  std::array<double, kMaxEffectorCoordinates> correction{};  ///< of it by sensors, m or m³
};

}  // namespace tendril::rt
