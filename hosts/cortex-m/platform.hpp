// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

// All that a case asks of what it runs on: the target (target/platform.cpp) or the host (host_platform.cpp).
void start_clock();
std::uint32_t clock_ticks();  ///< Counts up, wraps.
void write_text(const char* text);
