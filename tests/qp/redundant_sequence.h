// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tests/qp/sequence.h"

namespace tendril::qp {

/// Names of the generated sequences: robots with more actuators than they need, and the least energy asked
/// for.
const std::vector<std::string>& redundant_sequences();

/// A sequence with this name. Its reference is the objective of a problem of one level, solved from an empty
/// working set; the windows of the top rate are those of this solution.
Sequence redundant_sequence(const std::string& name);

}  // namespace tendril::qp
