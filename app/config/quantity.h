// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "hal/drive/settings.h"

namespace tendril::app {

using hal::Dimension;

/// Reads "numbers unit" ("0 0 125 mm", "150 kPa", "0.45") whatever the locale: as many finite decimal numbers
/// as `out` has room for, parted by blanks, then one unit of the dimension (none for kNumber).
/// @param out  receives the numbers in the SI unit; unspecified where the answer is false
/// @return     false where the text is anything else: too few or too many numbers, a unit of another
/// dimension,
///             NaN, infinity, a number beyond the range of double, anything after the unit
/// Real-time: no (set-up only).
[[nodiscard]] bool parse_quantity(std::string_view text, Dimension dimension, std::span<double> out);

/// The units a dimension may be written in, the SI unit first: "N, mN, kN"; empty for kNumber.
/// Real-time: no (allocates).
std::string units_of(Dimension dimension);

/// The magnitudes that values of a dimension may have in a robot file, beside 0, in the SI unit. The table in
/// docs/robot-file.md is theirs.
struct Magnitudes {
  double least, greatest;
};
Magnitudes magnitudes_of(Dimension dimension);

/// The SI unit of a dimension: "N"; empty for kNumber.
/// Real-time: no (set-up only).
std::string_view si_unit(Dimension dimension);

/// What parse_quantity takes, for a message that says what is expected: "two forces (N, mN, kN), as in '1 2
/// N'".
/// @param count  how many numbers
/// Real-time: no (allocates).
std::string describe_quantity(std::size_t count, Dimension dimension);

}  // namespace tendril::app
