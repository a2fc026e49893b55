// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <complex>
#include <resonid/data/frequency_response.hpp>
#include <resonid/data/record.hpp>
#include <resonid/fit/response_fit.hpp>
#include <vector>

// What lines of a measured response say, and how much of it each says by itself.
namespace resonid::fit::detail {

/// One of the two points that stand for a smoothed line, and its share (data::Smoothing). Known and smoothed
/// phasors differ by the delay's phase over the distance.
struct Point {
  double frequency_hz = 0.0;
  std::complex<double> share = 1.0;
};
using Points = std::array<Point, 2>;

/// [line]
[[nodiscard]] std::vector<Points> points_of(const data::FrequencyResponse& g, double known_delay_s);

/// [line] The model as the response shows it: that of the driven side, or of the load by a second output.
[[nodiscard]] std::vector<std::complex<double>> as_measured(const data::FrequencyResponse& g,
                                                            const DriveModel& model,
                                                            data::SecondOutput output);

/// Smallest relative model error e with mean |error|^2 / (std^2 + (e |G|)^2) = (degrees of freedom)/(data); 0
/// while the mean exceeds that by no more than chance does, two standard deviations of `independent` lines.
[[nodiscard]] double explaining_error(const data::FrequencyResponse& g,
                                      const std::vector<std::complex<double>>& fitted, double wanted,
                                      double independent);

/// [line] By what real and imaginary part of a difference are weighted: the inverse of their deviation.
[[nodiscard]] std::vector<double> weights(const data::FrequencyResponse& g, Weighting weighting,
                                          double error);

/// How many correlated lines are worth one independent line: n/(sum of all correlations) of them are there.
[[nodiscard]] double known_repetition(const data::FrequencyResponse& g);

/// By how much neighbouring lines repeat one another: 1 + 2 sum of the autocorrelation of the weighted
/// differences over the lines, up to where it has died out. Smoothed responses, and models that are wrong in
/// a smooth way, have many lines and little information.
[[nodiscard]] double repetition(const data::FrequencyResponse& g, double model_error,
                                const std::vector<std::complex<double>>& fitted);

}  // namespace resonid::fit::detail
