// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include "case.hpp"

/// The drive behind every record: two masses, PI velocity loop, small output noise.
namespace drive {

inline constexpr double kSampleRateHz = 256.0;
inline constexpr double kDrivenInertiaKgm2 = 0.02, kLoadInertiaKgm2 = 0.03;
inline constexpr double kStiffnessNmPerRad = 2000.0, kDampingNmsPerRad = 0.5;
/// u = ru - C y in powers of z^-1; exact in binary.
inline constexpr double kControllerNumerator[2] = {1.0 + 1.0 / 64.0, -1.0};
inline constexpr double kControllerDenominator[2] = {1.0, -1.0};

inline constexpr std::size_t kLines = 21;
/// Multisine: lines at 10, 20 ... 210 times this.
inline constexpr double kLineSpacingHz = kSampleRateHz / 1024.0;
inline constexpr double kChirpFromHz = 10.0, kChirpToHz = 100.0, kChirpDurationS = 16.0;

}  // namespace drive

/// Fills the record in integer arithmetic, so that host and target see the same floats to the last bit: only
/// tables that the compiler evaluates come from floating-point arithmetic.
void make_record(Injection injection, std::span<Sample> samples);
