// SPDX-License-Identifier: Apache-2.0
// A library that tools/vcan loads before user-mode-linux, so that it runs on processors with AMX.
//
// User-mode-linux restores a process's floating-point registers with ptrace(PTRACE_SETREGSET, NT_X86_XSTATE)
// from the part of the processor's state that it knows of: 2696 bytes, up to AVX-512 and the protection keys.
// The kernel takes the whole state or nothing [xstateregs_set in linux/arch/x86/kernel/fpu/regset.c]; with
// the tile registers of AMX that is 11008 bytes, and the first process of user-mode-linux dies of EFAULT.
// This ptrace adds the rest, as the state of tiles that were never used: processes have to ask for them, and
// those inside cannot.

#include <dlfcn.h>
#include <elf.h>
#include <sys/ptrace.h>
#include <sys/uio.h>

#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace {

// The bit map of the components that the state holds, at the start of the XSAVE header, and those of the
// tiles, XTILECFG and XTILEDATA [Intel SDM volume 1, 13.1 and 13.4.2].
constexpr std::size_t kComponentsOffset = 512;
constexpr uint64_t kTileComponents = 1u << 17 | 1u << 18;

// Static: the stacks of user-mode-linux are small. It has one thread.
unsigned char state[1 << 16];

using Ptrace = long (*)(__ptrace_request, int, void*, void*);

long set_extended_state(Ptrace next, int process, void* set, iovec* known) {
  iovec whole{state, sizeof state};
  if (next(PTRACE_GETREGSET, process, set, &whole) != 0 || whole.iov_len <= known->iov_len)
    return next(PTRACE_SETREGSET, process, set, known);
  std::memset(state, 0, whole.iov_len);
  std::memcpy(state, known->iov_base, known->iov_len);
  uint64_t components;
  std::memcpy(&components, state + kComponentsOffset, sizeof components);
  components &= ~kTileComponents;
  std::memcpy(state + kComponentsOffset, &components, sizeof components);
  return next(PTRACE_SETREGSET, process, set, &whole);
}

}  // namespace

extern "C" long ptrace(__ptrace_request request, ...) noexcept {
  static const auto next = reinterpret_cast<Ptrace>(dlsym(RTLD_NEXT, "ptrace"));
  va_list arguments;
  va_start(arguments, request);
  const int process = va_arg(arguments, int);
  void* const address = va_arg(arguments, void*);
  void* const data = va_arg(arguments, void*);
  va_end(arguments);
  if (request == PTRACE_SETREGSET && reinterpret_cast<std::uintptr_t>(address) == NT_X86_XSTATE)
    return set_extended_state(next, process, address, static_cast<iovec*>(data));
  return next(request, process, address, data);
}
