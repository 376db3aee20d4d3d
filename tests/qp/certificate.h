// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tests/qp/random_problem.h"

namespace tendril::qp {

/// How far from optimal x is, without the solver's own multipliers: those that leave the least of the
/// gradient are found here, among the constraints that x meets at a bound, each with the sign of its side.
/// [Karush-Kuhn-Tucker; Lawson & Hanson 1974, algorithm NNLS]
/// @param x  n values that meet bounds and rows, up to rounding
/// @return   |H x + g + Cᵀy| in the metric of H⁻¹, relative to its terms; half its square bounds by how much
/// the
///     objective exceeds the least one, relative to the objective's terms. Where H is singular it stands for
///     H + 1e-6 diag(H).
double stationarity(const Qp& qp, const Vector& x);

}  // namespace tendril::qp
