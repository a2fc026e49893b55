// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <identification/identify/select/select_drive.hpp>

namespace resonid::identification::detail {

/// Record -> response, by any method with fixed settings.
using Measure = std::function<expected<data::FrequencyResponse, Error>(const data::Record&)>;

/// Whether the error of the model goes into the standard deviations of what it corrects.
enum class Uncertainty { of_measurement, of_model };

/// A response freed from the bias of the method that measured it. The method runs once more on the noise-free
/// record that the model, its dry friction included, gives for the recorded input; what it makes of the
/// model's known response is its bias:
///
///   G_corrected = G_measured * G_model/G_measured(model)
///
/// Standard deviation: that of the measurement, and with Uncertainty::of_model that of the factor by the
/// model's covariance (the model moved along each of its principal directions, one run of the method for
/// each), squares added. Refuses what the method refuses.
[[nodiscard]] expected<data::FrequencyResponse, Error> corrected_response(
    const data::Record& record, const data::FrequencyResponse& measured, const ModelResult& model,
    double known_delay_s, const Measure& measure, Uncertainty uncertainty);

/// Two rounds of correction, the model fitted again after each; `response` and `selection` are replaced.
[[nodiscard]] expected<void, Error> simulate_and_correct(const data::Record& record, const Plan& plan,
                                                         const Options& options,
                                                         data::FrequencyResponse& response,
                                                         std::optional<Selection>& selection);

}  // namespace resonid::identification::detail
