// SPDX-License-Identifier: MIT
#pragma once

#include <complex>
#include <resonid/data/frequency_response.hpp>
#include <resonid/data/transfer_function.hpp>
#include <resonid/plant/detail/drive.hpp>
#include <resonid/plant/detail/measurement.hpp>
#include <vector>

namespace resonid::plant {

// `controller` is the law C from the measured velocity to -u, of a cascade without its position loop, which
// is part of the path.

/// The pole of greatest magnitude of the closed loop u = -C y, with the sampled machine, the delay line and
/// the velocity's path; in the z-plane. Where values are held over n samples: of one sample in the mean of n,
/// its angle not known.
[[nodiscard]] std::complex<double> dominant_loop_pole(const SampledDrive& drive, const SampleDelay& delay,
                                                      const VelocityPath& path,
                                                      const data::TransferFunction& controller);

/// L = C times what is read, at these frequencies: every delay in it, fractions exactly. A velocity held over
/// n samples is 0 ... n-1 samples late in turn: the mean of these.
[[nodiscard]] data::FrequencyResponse loop_response(const SampledDrive& drive, const SampleDelay& delay,
                                                    const VelocityPath& path,
                                                    const data::TransferFunction& controller,
                                                    std::vector<double> frequency_hz);

/// Whether the same loop has a pole outside the unit circle, for delays of any length: by the turns of 1 +
/// L(z) around 0 just outside the circle (Nyquist). Machine and controller have no such pole of their own.
[[nodiscard]] bool loop_is_unstable(const SampledDrive& drive, const SampleDelay& delay,
                                    const VelocityPath& path, const data::TransferFunction& controller);

}  // namespace resonid::plant
