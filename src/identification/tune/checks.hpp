// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/tune.hpp>
#include <span>
#include <vector>

#include "design/machine.hpp"
#include "design/posterior.hpp"

namespace resonid::identification {

/// What is out of range in the options, or does not go with these results.
[[nodiscard]] expected<void, Error> check(std::span<const Result> results, const TuneOptions& options);

/// Standard deviation of a delay that a result gives none.
[[nodiscard]] double assumed_delay_std(const Result& result);
/// Whether it had to be assumed.
[[nodiscard]] bool has_delay_std(const Result& result);

/// Over how many samples the measured velocity stays what it is, 1: it is new in each of them. Models are of
/// the machine without that hold.
[[nodiscard]] std::size_t hold_of(const Result& result);

/// By what the measured velocity is later than the response says: the known delay, and the hold in the mean,
/// s.
[[nodiscard]] double late_by(const Result& result);

/// The machine as a loop meets it: a velocity that stays over n samples is late by (n - 1)/2 of them in the
/// mean (docs/methods/tune.md 3.1).
[[nodiscard]] fit::DriveModel machine_of(const Result& result);

/// What each result leaves open of its machine.
[[nodiscard]] std::vector<design::Posterior> posteriors_of(std::span<const Result> results,
                                                           const TuneOptions& options);

/// The band in which a result's response is known to 30 %, Hz; empty where it is nowhere.
struct MeasuredBand {
  double low_hz = 0.0, high_hz = 0.0;
};
[[nodiscard]] MeasuredBand measured_band(const Result& result);

/// Refuses a loop that crosses where nothing was measured.
[[nodiscard]] expected<void, Error> check_crossover(const TunedController& controller,
                                                    const std::vector<design::Machine>& machines,
                                                    std::span<const Result> results);

}  // namespace resonid::identification
