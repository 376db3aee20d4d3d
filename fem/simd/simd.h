#pragma once

namespace tendril::fem {

/// True where this processor and its operating system run code built for x86-64-v4 (AVX-512).
///
/// Hot kernels are compiled twice from one body, for the instruction set of the build (x86-64-v3 unless told
/// otherwise) and for x86-64-v4, and chosen by this once. Such a source file may include no library code that
/// is inline: the linker keeps one copy of an inline function, and if it kept the x86-64-v4 one, a processor
/// without AVX-512 would run it elsewhere. So the bodies are plain loops over doubles and vectors of the
/// compiler, all in an anonymous namespace. The sets round differently in the last bit.
bool runs_x86_64_v4();

}  // namespace tendril::fem
