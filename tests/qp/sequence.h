// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "qp/solver.h"

namespace tendril::qp {

/// A recorded sequence of control cycles with its reference solutions, from one pair of .qps and .ref files.
struct Sequence {
  struct Snapshot {
    Matrix H, A;
  };
  struct Tick {
    int snapshot = 0;
    bool infeasible = false;  // by the reference: the rows cannot be met within the bounds
    Vector g;
    Bounds bounds;
    double objective = 0;  // of the reference, where feasible
    double scale = 0;      // ½ d'd, that of the objective
  };
  std::string name;
  int effector_coordinates = 0;
  TieBreak tie_break = TieBreak::kAny;
  std::vector<Snapshot> snapshots;
  std::vector<Tick> ticks;
};

/// The sequences of TENDRIL_SHARED_DATA/qp in alphabetical order; none where the folder is absent.
std::vector<std::filesystem::path> sequence_files();

/// @throws std::runtime_error naming a file that is not what its header says
Sequence read_sequence(const std::filesystem::path& qps);

}  // namespace tendril::qp
