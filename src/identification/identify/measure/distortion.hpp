// SPDX-License-Identifier: MIT
#pragma once

#include <identification/identify/measure/methods.hpp>
#include <optional>
#include <resonid/diagnostics/finding.hpp>
#include <resonid/identification/result.hpp>
#include <span>

namespace resonid::identification::detail {

/// What a best linear approximation says of noise and distortion, in the terms of the response made of it.
[[nodiscard]] Distortion distortion_of(const response::BestLinearApproximation& measured,
                                       const response::ResponseOptions& options,
                                       const data::FrequencyResponse& response);

/// Adds what the lines tell that the excitation leaves out, if it does: of one periodic record, or of several
/// realisations.
void add_detection_lines(std::span<const data::Record> realisations, std::size_t period_samples,
                         std::optional<Distortion>& distortion);

/// Both, of a record that is averaged over periods; nothing for other methods, or when neither tells.
[[nodiscard]] std::optional<Distortion> find_distortion(const data::Record& record, const Plan& plan,
                                                        const Options& options, const Measured& measured,
                                                        const data::FrequencyResponse& response);

/// Whether realisations tell of more distortion than noise, each in one realisation's response.
[[nodiscard]] bool exceeds_noise(const std::optional<Distortion>& distortion);

/// `non-linear-distortion`, when there is more than noise explains.
[[nodiscard]] std::vector<diagnostics::Finding> inspect_distortion(const Distortion& distortion);

}  // namespace resonid::identification::detail
