// SPDX-License-Identifier: Apache-2.0
#include "hal/drive/axis_table.h"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cstdio>
#include <random>
#include <vector>

#include "hal/cia402/cia402_setup.h"
#include "tests/hal/rig.h"

namespace tendril::hal::axis_table_test {
using namespace tendril::hal::test;

constexpr uint32_t kIdentifiers = 0x800;

/// Compares all 11-bit identifiers, and the 29-bit ones of the same numbers, with what is expected of them.
/// @param axis_of  the axis that receives a frame of that identifier; AxisTable::kNoAxis: none
/// @return         the identifiers that some axis receives
int check_all(const AxisTable& table, const auto& axis_of) {
  int received = 0;
  for (uint32_t id = 0; id < kIdentifiers; ++id) {
    const int expected = axis_of(id);
    if (expected != AxisTable::kNoAxis) ++received;
    const bool right = table.find({.id = id, .length = 8}) == expected &&
                       table.find({.id = id, .remote = true}) == expected &&
                       table.find({.id = id, .extended = true, .length = 8}) == AxisTable::kNoAxis;
    if (!right) FAIL("identifier " << id << ", expected axis " << expected);
  }
  CHECK(table.find({.id = kIdentifiers, .length = 8}) == AxisTable::kNoAxis);
  return received;
}

/// The index of the only axis with that node; kNoAxis where there is none.
int axis_with_node(const MasterConfig& config, uint32_t node) {
  for (size_t i = 0; i < config.axes.size(); ++i)
    if (config.axes[i].node == static_cast<int>(node)) return static_cast<int>(i);
  return AxisTable::kNoAxis;
}

/// The largest robot, with its nodes in an order other than that of the axes.
MasterConfig shuffled(MasterConfig config, int largest_node) {
  std::mt19937 random(static_cast<unsigned>(largest_node));
  std::printf("seed %d\n", largest_node);
  std::vector<int> nodes;
  for (int node = config.axes[0].node; node <= largest_node; ++node) nodes.push_back(node);
  std::shuffle(nodes.begin(), nodes.end(), random);
  for (size_t i = 0; i < config.axes.size(); ++i) config.axes[i].node = nodes[i];
  return config;
}

TEST_CASE("Of 32 CiA 402 axes each receives the four identifiers of its own drive and no others", "[unit]") {
  const MasterConfig config = shuffled(config_of(kMaxAxes), 126);
  const AxisTable table(config.axes, received_cia402_ids);
  const auto axis_of = [&config](uint32_t id) {  // CiA 301, predefined connection set
    const uint32_t base = id & ~0x7Fu;
    const bool received = base == 0x080 || base == 0x180 || base == 0x580 || base == 0x700;
    return received ? axis_with_node(config, id & 0x7Fu) : AxisTable::kNoAxis;
  };
  CHECK(check_all(table, axis_of) == 4 * kMaxAxes);
}

TEST_CASE("Of 32 ODrive axes each receives the two identifiers of its own node and no others", "[unit]") {
  const MasterConfig config = shuffled(odrive_config_of(kMaxAxes), 62);
  const AxisTable table(config.axes, received_odrive_ids);
  const auto axis_of = [&config](uint32_t id) {  // CANSimple: node << 5 | message
    const uint32_t message = id & 0x1Fu;
    return message == 0x01 || message == 0x09 ? axis_with_node(config, id >> 5) : AxisTable::kNoAxis;
  };
  CHECK(check_all(table, axis_of) == 2 * kMaxAxes);
}

TEST_CASE("A CiA 402 axis with a COB-ID of its own receives that one instead of the predefined one",
          "[unit]") {
  MasterConfig config = config_of(2);
  cia402_settings(config.axes[1]).tpdo_id = 0x3A5;
  const AxisTable table(config.axes, received_cia402_ids);
  CHECK(table.find({.id = 0x3A5}) == 1);
  CHECK(table.find({.id = 0x182}) == AxisTable::kNoAxis);
  CHECK(table.find({.id = 0x181}) == 0);
}

/// Runs a robot of 32 axes until all positions are known, sends one position to the master for each
/// identifier, and compares which axes have taken one.
template <class AnyRig>
void check_positions(const MasterConfig& config, const auto& position_id, uint8_t length) {
  AnyRig rig(config);
  REQUIRE(rig.run_until([&] { return rig.measured.all_known; }));
  const int64_t now_ns = rig.bus.time_ns();
  for (uint32_t id = 0; id < kIdentifiers; ++id) {
    const std::array<int64_t, kMaxAxes> before = rig.measured.displacement_stamp_ns;
    const int64_t stamp_ns = now_ns + id + 1;
    for (const bool extended : {true, false})
      rig.master.receive({.id = id, .extended = extended, .length = length}, extended ? 1 : stamp_ns);
    rig.measured = rig.master.measure(BusHealth::kActive, now_ns);
    for (int i = 0; i < kMaxAxes; ++i) {
      const int64_t expected = id == position_id(config.axes[i]) ? stamp_ns : before[i];
      if (rig.measured.displacement_stamp_ns[i] != expected) FAIL("identifier " << id << ", axis " << i);
    }
  }
}

TEST_CASE("A position reaches the axis of its identifier alone, with 32 axes of either protocol", "[unit]") {
  check_positions<Rig>(
      shuffled(config_of(kMaxAxes), 126), [](const AxisConfig& axis) { return 0x180u + axis.node; }, 6);
  check_positions<OdriveRig>(
      shuffled(odrive_config_of(kMaxAxes), 62), [](const AxisConfig& axis) { return axis.node << 5 | 0x09u; },
      8);
}

}  // namespace tendril::hal::axis_table_test
