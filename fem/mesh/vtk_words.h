// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "fem/mesh/vtk_grid.h"

namespace tendril::fem {

inline constexpr NumberType kVtkInt = {NumberType::Kind::kSigned, 4};

/// How an array is stored in a legacy VTK file. Bits fill bytes where the file is binary; each string or
/// variant has a line of its own where the file is ASCII.
struct VtkStorage {
  enum class Form { kNumbers, kBits, kStrings, kVariants };
  Form form = Form::kNumbers;
  NumberType number = kVtkInt;
};

/// How arrays of a type are stored; none where VTK has no type of that name.
std::optional<VtkStorage> vtk_storage(std::string_view type);

/// The word in capitals: VTK takes keywords and types in any case.
std::string in_capitals(std::string_view word);

/// The name that VTK wrote as a word: blanks and the like as % and two hexadecimal digits.
std::string decoded_name(std::string_view word);

}  // namespace tendril::fem
