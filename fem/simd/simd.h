// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace tendril::fem {

/// Instruction sets that hot kernels are compiled for. tendril_kernels() of CMakeLists.txt compiles each
/// source once for each.
///
/// Such a source may include no library code that is inline: the linker keeps one copy of an inline function.
/// If it kept the x86-64-v4 one, a processor without AVX-512 would run it elsewhere. So the kernels are plain
/// loops over doubles and vectors of the compiler, all in an anonymous namespace. The sets round differently
/// in the last bit.
enum class InstructionSet {
  kScalar,  ///< no kernels: elements are computed one by one
  kV3,      ///< that of the build, x86-64-v3 (AVX2) unless told otherwise
  kV4,      ///< x86-64-v4 (AVX-512), x86 only
};

#ifdef __x86_64__
inline constexpr bool kHasV4 = true;
#else
inline constexpr bool kHasV4 = false;
#endif

/// The largest set that this processor and its operating system run. Real-time: no.
InstructionSet best_instruction_set();

}  // namespace tendril::fem
