// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>

namespace tendril::tools {

/// What decides on latencies and can be read without rights: kernel and its command line, preemption model,
/// CPU, governor, isolated CPUs, CPUs of the same core, clock source; null where this machine does not tell.
/// @param cpu  the one that governor and core are told of; -1: the first
nlohmann::ordered_json describe_machine(int cpu);

}  // namespace tendril::tools
