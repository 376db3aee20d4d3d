// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "hal/bus/bus.h"

namespace tendril::hal {

/// On a local socket the host listens and the others join it; on CAN all nodes are alike.
enum class BusRole : uint8_t { kJoin, kHost };

/// How long a joiner of a local bus waits for its host unless told otherwise.
inline constexpr int64_t kJoinWait_ns = 5'000'000'000;

/// Opens the bus of that name.
/// @param name     "local:PATH" for a bus on a UNIX socket, anything else is a CAN interface ("can0")
/// @param role     who listens on a local bus; no difference on CAN
/// @param wanted   identifiers, see marked_id, of the frames to receive: on CAN the kernel keeps all others
///                 away from the caller, a local bus need not. Empty: all frames,
///                 remote ones included, which no list can name
/// @param wait_ns  how long a joiner retries while nobody listens at PATH
/// @throws BusError where it cannot be opened
/// Real-time: no (allocates, may sleep).
std::unique_ptr<Bus> open_bus(const std::string& name, BusRole role, std::span<const uint32_t> wanted = {},
                              int64_t wait_ns = kJoinWait_ns);

}  // namespace tendril::hal
