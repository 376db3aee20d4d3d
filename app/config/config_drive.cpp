// SPDX-License-Identifier: Apache-2.0
#include "app/config/config_drive.h"

namespace tendril::app {

std::function<void(Reader&, hal::AxisConfig&)> drive_of(const SpokenProtocol& protocol, std::string_view key,
                                                        Dimension dimension, double factor) {
  return [=](Reader& r, hal::AxisConfig& drive) {
    double length_or_volume = 0;
    r.need(key, length_or_volume, dimension, kPositive);
    drive.scale.displacement_per_turn = factor * length_or_volume;
    r.may("reversed", drive.scale.reversed);
    r.may("offset", drive.scale.offset, dimension);
    r.may("setpoint", drive.set_point,
          Words<hal::SetPoint>{{"displacement", hal::SetPoint::kDisplacement},
                               {"effort", hal::SetPoint::kEffort}});
    r.may("following_error", drive.following_error, dimension, kPositive);
    if (drive.set_point == hal::SetPoint::kEffort && drive.following_error > 0)
      r.at("following_error").fail("no such key, as drive.setpoint is effort");
    read_protocol_keys(r, protocol.known, protocol.spoken, drive,
                       [dimension](const hal::DriveProtocol& its, hal::Settings& section,
                                   hal::AxisConfig& axis) { its.read_drive(section, dimension, axis); });
  };
}

}  // namespace tendril::app
