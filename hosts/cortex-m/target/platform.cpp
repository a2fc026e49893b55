// SPDX-License-Identifier: MIT
#include "../platform.hpp"

#include "semihosting.hpp"

namespace {

/// CMSDK timer 0 of the MPS2 boards: counts down at the system clock of 25 MHz. Unlike SysTick it has 32
/// bits.
struct Timer {
  volatile std::uint32_t control, value, reload;
};
Timer& timer() { return *reinterpret_cast<Timer*>(0x40000000U); }

}  // namespace

void start_clock() {
  timer().reload = 0xFFFFFFFFU;
  timer().value = 0xFFFFFFFFU;
  timer().control = 1;
}
std::uint32_t clock_ticks() { return ~timer().value; }

void write_text(const char* text) { semihosting::write(text); }
