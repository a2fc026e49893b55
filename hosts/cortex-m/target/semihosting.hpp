// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

/// What a program on a bare target asks of the debugger or emulator that runs it: Arm's semihosting
/// interface, https://github.com/ARM-software/abi-aa/blob/main/semihosting/semihosting.rst
namespace semihosting {

enum class Operation : std::uint32_t { write_zero_terminated = 0x04, exit_extended = 0x20 };

inline std::uint32_t call(Operation operation, const void* argument) {
  register std::uint32_t r0 asm("r0") = static_cast<std::uint32_t>(operation);
  register const void* r1 asm("r1") = argument;
  asm volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}

inline void write(const char* text) { call(Operation::write_zero_terminated, text); }

[[noreturn]] inline void exit_with(int code) {
  constexpr std::uint32_t kApplicationExit = 0x20026;
  const std::uint32_t block[2] = {kApplicationExit, static_cast<std::uint32_t>(code)};
  call(Operation::exit_extended, block);
  for (;;) {
  }
}

}  // namespace semihosting
