#include "app/config/config_drive.h"

#include <cmath>
#include <cstdint>
#include <optional>

namespace tendril::app {
namespace {

constexpr auto kCanopen = hal::Protocol::kCanopen, kOdrive = hal::Protocol::kOdrive;
constexpr Range kHomingMethod = {.at_least = -128, .at_most = 127};  // object 6098, i8
constexpr Range kHomingQuantity = {.at_least = 1};

/// The identifier of a PDO: what CANopen keeps for other messages is not to be had [CiA 301, restricted
/// COB-IDs].
void read_cob_id(const Value& v, std::uint32_t& id) {
  int number = 0;
  v.read(number, Range{.at_least = 0x181, .at_most = 0x57F});
  id = static_cast<std::uint32_t>(number);
}

/// A bit of the statusword with a meaning of the maker's.
void read_makers_bit(const Value& v, int& bit) {
  v.read(bit);
  if (bit != 8 && bit != 14 && bit != 15) v.fail("8, 14 or 15, the bits that CiA 402 leaves to the maker");
}

/// A whole number as an object of the drive holds it.
template <class T>
auto whole(const Range& range) {
  return [range](const Value& v, std::optional<T>& out) {
    int number = 0;
    v.read(number, range);
    out = static_cast<T>(number);
  };
}

void read_homing(Reader& r, hal::HomingConfig& homing) {
  double timeout = 1e-9 * static_cast<double>(homing.timeout_ns);
  r.may("method", homing.method, whole<std::int8_t>(kHomingMethod));
  r.may("speed_search", homing.speed_search, whole<std::uint32_t>(kHomingQuantity));
  r.may("speed_zero", homing.speed_zero, whole<std::uint32_t>(kHomingQuantity));
  r.may("acceleration", homing.acceleration, whole<std::uint32_t>(kHomingQuantity));
  r.may("timeout", timeout, Dimension::kTime, Range{.above = 0, .at_most = 3600});
  homing.timeout_ns = std::llround(1e9 * timeout);
}

/// @param dimension  of displacements
void read_canopen(Reader& r, hal::CanopenAxis& axis, hal::Protocol protocol, Dimension dimension) {
  r.may("pdo", axis.pdo, only_with(kCanopen, protocol, Range{.at_least = 1, .at_most = 4}));
  r.may("rpdo_id", axis.rpdo_id, only_with(kCanopen, protocol, read_cob_id));
  r.may("tpdo_id", axis.tpdo_id, only_with(kCanopen, protocol, read_cob_id));
  r.may("mapping", axis.mapping,
        only_with(kCanopen, protocol,
                  Words<hal::Mapping>{{"configure", hal::Mapping::kConfigure},
                                      {"as_found", hal::Mapping::kAsFound}}));
  r.may("referenced_bit", axis.referenced_bit, only_with(kCanopen, protocol, read_makers_bit));
  r.may("homing", axis.homing, only_with(kCanopen, protocol, read_homing));
  r.may("soft_limits", axis.soft_limits, only_with(kCanopen, protocol));
  r.may("following_error", axis.following_error, only_with(kCanopen, protocol, dimension, kPositive));
  r.may("rated_torque", axis.rated_torque, only_with(kCanopen, protocol, Dimension::kTorque, kPositive));
}

void refuse_counts(const Value& v, double&) {
  v.fail(
      "no such key, as bus.protocol is odrive, whose positions are in turns of the encoder; gear says how "
      "many of these make one of the pulley, screw or pump");
}

}  // namespace

std::function<void(Reader&, DriveConfig&)> drive_of(hal::Protocol protocol, std::string_view key,
                                                    Dimension dimension, double factor) {
  return [=](Reader& r, DriveConfig& drive) {
    drive.line = r.line();
    r.need("node", drive.node, protocol == kOdrive ? kOdriveNode : kCanopenNode);
    if (protocol == kOdrive)
      r.may("counts_per_turn", drive.counts_per_turn, refuse_counts);
    else
      r.need("counts_per_turn", drive.counts_per_turn, Dimension::kNumber, kPositive);
    double length_or_volume = 0, gear = 1;
    r.need(key, length_or_volume, dimension, kPositive);
    r.may("gear", gear, only_with(kOdrive, protocol, Dimension::kNumber, kPositive));
    drive.displacement_per_turn = factor * length_or_volume / gear;
    r.may("reversed", drive.reversed);
    r.may("offset", drive.offset, dimension);
    if (protocol == kOdrive)
      r.may("reference", drive.counts_from_power_on, Words<bool>{{"absolute", false}, {"power_on", true}});
    else
      r.may("reference", drive.canopen.reference,
            Words<hal::Reference>{{"absolute", hal::Reference::kAbsolute},
                                  {"homing", hal::Reference::kHoming}});
    r.may("setpoint", drive.set_point,
          Words<hal::SetPoint>{{"displacement", hal::SetPoint::kDisplacement},
                               {"effort", hal::SetPoint::kEffort}});
    read_canopen(r, drive.canopen, protocol, dimension);
    r.may("velocity_limit", drive.velocity_limit,
          only_with(kOdrive, protocol, Dimension::kTurnRate, kPositive));
    r.may("current_limit", drive.current_limit, only_with(kOdrive, protocol, Dimension::kCurrent, kPositive));
  };
}

}  // namespace tendril::app
