// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <resonid/planning/plan.hpp>
#include <resonid/report/document.hpp>
#include <string>
#include <vector>

namespace resonid::report {

/// What a plan comes to, in plain sentences, whether the wishes are met first.
[[nodiscard]] std::vector<std::string> sentences(const planning::Plan& plan);

/// Readable summary for a terminal, lines of at most 100 characters.
[[nodiscard]] std::string summary_text(const planning::Plan& plan);

/// The object of `plan --json`:
///
///     {schema: "resonid.plan/1", reached, type, duration_s, sample_rate_hz, samples, binding_limit,
///      criterion, spread, drives, band_hz: [low, high],
///      limits: {torque, excitation, torque_rms, velocity, stroke, time_s},
///      model: {structure, parameters: {driven_inertia, ...}, delay_s, noise_rms},
///      excitation: {peak, crest_factor, period_samples, periods, settle_periods, lines_hz: [],
///                   amplitudes: [], phases_rad: []} | {peak, from_hz, to_hz} | {peak, register_length,
///                   clock_divider, power_below_band, power_above_band},
///      extremes: {excitation, torque, torque_rms, velocity, stroke},
///      wishes: [{figure, wanted_std, expected_std, unit, reached}], worst_ratio, needed_s,
///      needed_amplitude, noise_dominates, noise_torque,
///      left_out: [{type, reason}], two_steps: {first_s, spread, second_s, total_s, one_s},
///      figures: [{name, value, std, unit}],
///      alternatives: [{type, peak, worst_ratio, needed_s, least_s, extremes, figures, excitation (PRBS)}]}
///
/// `std` are those of the rough model, `expected_std` those expected over all drives that it may stand for.
/// What is not there is absent.
[[nodiscard]] nlohmann::json to_json(const planning::Plan& plan);

/// The page of `plan --report`: error bars side by side, spectrum beside the response, waveforms.
[[nodiscard]] Document document(const planning::Plan& plan);

}  // namespace resonid::report
