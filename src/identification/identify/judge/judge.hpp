// SPDX-License-Identifier: MIT
#pragma once

#include <identification/identify/select/select.hpp>

namespace resonid::identification::detail {

/// The fourth step of identify(): everything that measurement and model come to. Modes, roots, validation and
/// loop; and the findings, each step's own first. The response is the measured one.
[[nodiscard]] Result judge(const Experiment& experiment, const Measurement& measurement, Fitted fitted,
                           const Options& options);

/// The options with the controller that ran: the identified one where none was given, or another one.
[[nodiscard]] Options with_real_controller(const Measurement& measurement, const Options& options);

/// Where a record can show a mode.
[[nodiscard]] std::pair<double, double> visible_modes_hz(const Plan& plan);

/// The last word: the model's response where it stands for the measured one, and the verdict.
void conclude(const Options& options, Result& result);

}  // namespace resonid::identification::detail
