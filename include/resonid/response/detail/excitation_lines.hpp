// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <resonid/base/approach.hpp>
#include <resonid/data/record.hpp>
#include <resonid/online/lines/detail/sweep.hpp>
#include <span>
#include <utility>
#include <vector>

namespace resonid::response {

/// Power from which on a line of a periodic reference counts as excited, given the powers of all lines: in
/// the middle of the widest gap between neighbouring powers when it is a factor of 9 or more (3 in amplitude;
/// below lie the harmonics and intermodulation of a real torque loop), else, and at least, 1e-4 of the
/// greatest (PRBS).
[[nodiscard]] double excited_power_threshold(std::vector<double> powers);

/// Period of the excitation (of the input, when the record has no excitation), in samples; nothing when it
/// does not repeat at least twice in the record. From the first peak of the normalised autocorrelation that
/// comes within 0.5 % of the highest one. Also that of an excitation whose phases change every few periods
/// (detect_realisation_period()). Limit: a multisine whose lines all lie near multiples of a coarser
/// spacing needs a signal-to-noise ratio above 200 to be told from one with that shorter period.
[[nodiscard]] std::optional<std::size_t> detect_period(const data::Record& record);

/// Whether 98 % of the samples lie within `tolerance` of the range from one of its ends, as those of a PRBS
/// do.
[[nodiscard]] bool two_level(const std::vector<double>& samples, double tolerance);

/// Lowest and highest frequency that the reference signal of an approach excites: where its smoothed power
/// density is at least `share` of the densest; nothing for a signal without power.
[[nodiscard]] std::optional<std::pair<double, double>> excited_band_hz(const data::Record& record,
                                                                       Approach approach, double share = 0.1);

/// Law of the excitation (of the input, when the record has no excitation) if it is one linear or logarithmic
/// chirp of constant amplitude from the record's first sample on, to its end or until it falls silent;
/// nothing when in doubt.
///
/// The frequency of the analytic signal gives a law (median of slopes), its phase in 64 blocks a better one,
/// and Gauss-Newton on x = c + A cos(phi(f0, f1) + p) the final one; f0 and f1 become round numbers where
/// those lie within 0.003/duration (0.6 degrees of phase). It is a chirp when that explains 97 % of the
/// variance and the blocks' phasors scatter around A by at most 2 % (rms; white noise may add to it), none by
/// more than 25 %.
/// The chirp may begin late by a fifth of a block, 1/300 of the sweep; the law holds from sample 0 on. Needs
/// 1024 samples and a sweep of 10/duration and of 5 %. Repeated chirps are refused: they have a period.
[[nodiscard]] std::optional<online::SweepLaw> detect_chirp(const data::Record& record);

}  // namespace resonid::response
