#pragma once

#include <nlohmann/json.hpp>

namespace tendril::tools {

/// What decides on latencies and can be read without rights: kernel and its command line, preemption model,
/// CPU, governor, isolated CPUs, clock source; null where this machine does not tell.
nlohmann::ordered_json describe_machine();

}  // namespace tendril::tools
