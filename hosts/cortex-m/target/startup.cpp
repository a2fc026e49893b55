// SPDX-License-Identifier: MIT
// From reset to program() on a Cortex-M with FPU, without any C library start-up.
#include <cstdint>

#include "semihosting.hpp"

int program();

extern "C" {
extern std::uint32_t image_data_load[], image_data_begin[], image_data_end[];
extern std::uint32_t image_bss_begin[], image_bss_end[], image_stack_top[];
[[noreturn]] void reset();
[[noreturn]] void fault();
}

namespace {

constexpr std::uintptr_t kCoprocessorAccess = 0xE000ED88U;  // CPACR, ARMv7-M architecture manual B3.2.20
constexpr std::uint32_t kFullAccessToFpu = 0xFU << 20U;
constexpr int kFaultExitCode = 99;

}  // namespace

// Runs before the FPU is on: no floating-point arithmetic here.
void reset() {
  *reinterpret_cast<volatile std::uint32_t*>(kCoprocessorAccess) |= kFullAccessToFpu;
  asm volatile("dsb\n isb" ::: "memory");
  const std::uint32_t* from = image_data_load;
  for (volatile std::uint32_t* to = image_data_begin; to != image_data_end; ++to) *to = *from++;
  for (volatile std::uint32_t* to = image_bss_begin; to != image_bss_end; ++to) *to = 0;
  semihosting::exit_with(program());
}

void fault() { semihosting::exit_with(kFaultExitCode); }

/// ARMv7-M vector table: initial stack pointer, reset, then the fault handlers. No interrupt is used.
using Handler = void (*)();
extern "C" [[gnu::section(".vectors"), gnu::used]] const Handler vectors[16] = {
    reinterpret_cast<Handler>(image_stack_top), reset, fault, fault, fault, fault, fault};
