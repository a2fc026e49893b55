// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/base/expected.hpp>
#include <resonid/data/record.hpp>
#include <vector>

namespace resonid::fit {

/// What of the record's input its excitation and reference explain: the input as it would be without output
/// noise. Fed to the plant in place of the recorded input it makes an open-loop fit consistent under feedback
/// without knowledge of the controller (two-stage method, Van den Hof and Schrama 1993).
///
///   u(k) = c + sum_{i=1} a_i u(k-i) + sum_{i=0} b_i ru(k-i) [+ sum_{i=0} c_i r(k-i)] + e(k),   simulated
///   with e = 0
///
/// The order, 1 ... 60, is the one with the smallest Bayesian information criterion of the simulated input. A
/// channel that does not vary explains nothing and is left out. The first samples are the recorded ones.
/// Errors: neither excitation nor reference varies, fewer than 200 samples, unequal lengths, samples that are
/// not finite, no order that simulates stably.
[[nodiscard]] expected<std::vector<double>, Error> projected_input(const data::Record& record);

}  // namespace resonid::fit
