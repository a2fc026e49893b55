// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/tune.hpp>
#include <span>
#include <string>
#include <vector>

#include "design/controller.hpp"
#include "design/ends_of_lines.hpp"
#include "design/machine.hpp"
#include "design/posterior.hpp"

namespace resonid::identification {

/// What is out of range in the options, or does not go with these results.
[[nodiscard]] expected<void, Error> check(std::span<const Result> results, const TuneOptions& options);

/// The file of a result as texts name it, "result 2" where it tells none; its machine, "the machine of
/// a.csv".
[[nodiscard]] std::string name_of_result(std::span<const Result> results, std::size_t i);
[[nodiscard]] std::string name_of_machine(std::span<const Result> results, std::size_t i);

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

/// How far below the first anti-resonance a loop has to cross for the load to follow calmly, if nothing else
/// is known of it: at a sixth |T_load| stays what it is for a rigid machine where the load has at least half
/// of the driven inertia and the anti-resonance a damping ratio of 0.02 (docs/methods/tune.md 7.10).
inline constexpr double kCalmBelowCompliance = 6.0;

/// Up to where the machine is as its model says: the end of the measured band; of a rigid model at most
/// a sixth of the first anti-resonance that the measured response may hide, which begins at the end of the
/// band where dry friction is in it and nothing compares it with the model.
[[nodiscard]] double known_to_hz(const Result& result);

/// What is wrong at the last line of a loop that is judged by lines, and what would cure it: "at the last
/// line
/// ...". `may_be`: |L| from there on.
[[nodiscard]] std::string end_of_lines_words(double last_hz, double may_be, const design::MachineEnd& end,
                                             bool controller_grows);

/// Rms of the torque that measurement noise makes, the largest of all machines: each by the noise of its own
/// result (that without one counts none).
[[nodiscard]] double noise_torque_of(const design::LinearController& controller,
                                     const std::vector<design::Machine>& machines,
                                     std::span<const Result> results);

/// Refuses a loop that crosses where nothing was measured.
[[nodiscard]] expected<void, Error> check_crossover(const TunedController& controller,
                                                    const std::vector<design::Machine>& machines,
                                                    std::span<const Result> results);

}  // namespace resonid::identification
