// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/response/line_estimates.hpp>

namespace resonid::response {

struct SteppedSineConfig {
  std::vector<double> lines_hz;  ///< Frequencies to report; empty: all that are found.
  double settling_share =
      1.0 / 3.0;          ///< Share of each dwell that is left out at its start at least, 0 ... 0.9.
  double settled = 0.01;  ///< Change of the output's phasor, relative, that still counts as settled.
};

/// Frequencies of a stepped sine, ascending, when the excitation (the input, when the record has no
/// excitation) clearly is one: at least three of them, each for three periods or more, together nine tenths
/// of the time during which anything is excited, and in each dwell 99.9 % of the variance. Empty otherwise.
/// Limits: a chirp swept slowly looks alike; ask detect_chirp() first.
[[nodiscard]] std::vector<double> detect_stepped_sine(const data::Record& record);

/// Lines of a stepped sine: one frequency after another.
///
/// The dwells are found in the exciting signal (excitation, else input), frequencies included, from the
/// corners of its phase. A dwell's first third is left out, and then as many periods as the output needs:
/// its phasors in single periods, counted back from the end, must lie within the scatter of the last third of
/// them (F test, 0.1 %; 1e-6 of the phasor is always good enough). On the whole periods left (8 samples and
/// more per period, else groups of periods)
///
///   x(k) = c + d k + Re{X e^{j w k Ts}}
///
/// is solved by least squares for each signal. Covariance from the cross density of the residuals at 1.5 ...
/// 4.5/T beside the line, T the time used, and the fit's noise gain; as many degrees of freedom as offsets.
/// A dwell goes to `unsettled_hz` when fewer than two periods are left, or the phasors change by more than
/// `settled` and either drift one way (von Neumann's ratio, 0.1 %) or scatter more in the first half used
/// than in the second (F test, 1 %). When a frequency was measured twice, the longer dwell counts. A given
/// line that no dwell matches within 0.1/(its length) is an error that names it. Limits: neighbouring
/// frequencies must differ by about 1/(dwell) to be told apart; without an excitation signal the input must
/// be a sine of which noise and feedback leave half the power (0.8 when no lines are given). A transient as
/// long as the dwell shows as noise only.
[[nodiscard]] expected<LineEstimates, Error> stepped_sine_lines(const data::Record& record,
                                                                const SteppedSineConfig& config,
                                                                Approach approach);

/// plant_response of stepped_sine_lines.
[[nodiscard]] expected<data::FrequencyResponse, Error> stepped_sine(const data::Record& record,
                                                                    const SteppedSineConfig& config,
                                                                    const ResponseOptions& options);

}  // namespace resonid::response
