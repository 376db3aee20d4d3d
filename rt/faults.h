// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

namespace tendril::rt {

/// What can be wrong in a control cycle.
enum class Fault : uint8_t {
  kSnapshotStale,
  kTargetStale,
  kTargetRefused,
  kQpSoftened,
  kQpCapped,
  kQpIllPosed,
  kLateCycles,
  kModelFailed,
  kSensorLost,
  kDrives,
};
inline constexpr int kFaultKinds = 10;

/// What the controller does about it, from the mildest on.
enum class Reaction : uint8_t {
  kServe,       ///< goes on with what it has; the cycle's command is within all limits
  kHoldTarget,  ///< goes on toward the last good target
  kHalt,        ///< comes to a halt and stays until the fault has passed
  kStop,        ///< controlled stop of all drives; the reason is latched
};

struct FaultRule {
  Fault fault;
  Reaction reaction;
  const char* words;
};

/// The fault table: every fault, what it leads to, and how a log calls it.
inline constexpr std::array<FaultRule, kFaultKinds> kFaultTable{{
    {Fault::kSnapshotStale, Reaction::kHalt, "the newest model snapshot is older than its limit"},
    {Fault::kTargetStale, Reaction::kHoldTarget, "the newest target is older than its limit"},
    {Fault::kTargetRefused, Reaction::kHoldTarget, "the target is not finite or outside the workspace"},
    {Fault::kQpSoftened, Reaction::kServe, "effort and displacement limits conflict; efforts win"},
    {Fault::kQpCapped, Reaction::kHalt, "the QP was stopped at its iteration cap"},
    {Fault::kQpIllPosed, Reaction::kHalt, "the QP was refused as ill-posed"},
    {Fault::kLateCycles, Reaction::kStop, "too many late cycles in a row"},
    {Fault::kModelFailed, Reaction::kStop,
     "the model failed: no equilibrium at the measured displacements, or no memory"},
    {Fault::kSensorLost, Reaction::kStop, "a sensor that the robot may not lose has fallen silent"},
    {Fault::kDrives, Reaction::kStop, "a drive or the bus failed"},
}};

constexpr const FaultRule& rule(Fault fault) noexcept { return kFaultTable[static_cast<std::size_t>(fault)]; }

/// The faults present in one cycle.
class FaultSet {
 public:
  void add(Fault fault) noexcept { bits_ |= bit(fault); }
  bool has(Fault fault) const noexcept { return (bits_ & bit(fault)) != 0; }
  /// Whether one of them demands at least that reaction.
  bool demand(Reaction reaction) const noexcept {
    for (const FaultRule& entry : kFaultTable)
      if (has(entry.fault) && entry.reaction >= reaction) return true;
    return false;
  }
  uint32_t bits() const noexcept { return bits_; }

 private:
  static constexpr uint32_t bit(Fault fault) noexcept { return 1u << static_cast<unsigned>(fault); }
  uint32_t bits_ = 0;
};

}  // namespace tendril::rt
