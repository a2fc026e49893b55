// SPDX-License-Identifier: MIT
#pragma once

#include <complex>
#include <resonid/data/transfer_function.hpp>
#include <resonid/plant/drive.hpp>
#include <resonid/plant/measurement.hpp>

namespace resonid::plant {

/// The pole of greatest magnitude of the closed loop u = -C y, with the sampled machine, the delay line and a
/// velocity from sensor or encoder differences; in the z-plane.
[[nodiscard]] std::complex<double> dominant_loop_pole(const SampledDrive& drive, const SampleDelay& delay,
                                                      VelocitySource velocity,
                                                      const data::TransferFunction& controller);

}  // namespace resonid::plant
