// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <optional>
#include <resonid/base/approach.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/data/record.hpp>
#include <resonid/response/line_estimates.hpp>
#include <span>
#include <vector>

namespace resonid::response {

/// The three signals of a record in the order excitation, input, output; a missing one is an empty span.
struct Signals {
  std::array<std::span<const double>, 3> signal;
  std::size_t reference = 0;  ///< Index of the signal to which the others are referred: input when direct.
  std::size_t samples = 0;

  [[nodiscard]] bool has(std::size_t i) const noexcept { return !signal[i].empty(); }
};

/// The signals that an approach needs; refuses a record that lacks one, has none, or has unequal lengths.
[[nodiscard]] expected<Signals, Error> signals_of(const data::Record& record, Approach approach);

/// LineEstimates without lines, with what is known of the record.
[[nodiscard]] LineEstimates empty_estimates(const data::Record& record, const Signals& signals);

/// Samples without their mean (`degree` 0) or without their least-squares line (`degree` 1).
[[nodiscard]] std::vector<double> detrended(std::span<const double> samples, int degree);

/// A periodic signal without the line through the means of its whole periods, which has no slope when nothing
/// drifts: unlike a least-squares line through the samples it leaves the periodic part untouched. At least
/// two periods.
[[nodiscard]] std::vector<double> without_drift(std::span<const double> samples, std::size_t period);

/// Neighbours on either side with whose scatter that of a line is averaged: as many as give twelve degrees of
/// freedom where it has `own`, at most four.
[[nodiscard]] std::size_t pooling_reach(double own);

/// 1 for positions, whose drift over a record is real; 0 for other quantities of the output and for torques.
[[nodiscard]] int trend_degree(const data::Record& record, std::size_t signal);

/// Checks 0 <= low < high <= Nyquist and resolves "0 = up to Nyquist".
[[nodiscard]] expected<double, Error> upper_band_edge(const data::Record& record, double low_hz,
                                                      double high_hz);

/// A position as its difference from sample to sample, one sample shorter, as a velocity: a ramp, a drift and
/// the slope of its spectrum leak into every line of a short window otherwise. Nothing of other quantities.
[[nodiscard]] std::optional<data::Record> differenced(const data::Record& record);

/// Lines of a differenced() record as those of its position.
[[nodiscard]] LineEstimates integrated(LineEstimates lines);

}  // namespace resonid::response
