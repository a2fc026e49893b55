// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/base/approach.hpp>
#include <resonid/data/frequency_response.hpp>
#include <resonid/data/record.hpp>
#include <resonid/data/two_mass.hpp>

#include "reproduction/vi_experiment.hpp"

namespace resonid::reproduction::vi {

/// Off-line response by averaged spectra: Hann segments of 4096 samples, half overlapping (METHOD 8.1).
[[nodiscard]] data::FrequencyResponse averaged_response(const data::Record& record, const Known& known,
                                                        Approach approach);

/// Model that eq. (28) compares with the measured response.
enum class ModelKind {
  sampled,    ///< Zero-order hold at the record's sample time: what sampled data show.
  continuous  ///< The physical equations as they stand, as printed.
};

/// Two-mass parameters from the least sum of |Ge - Gmodel|^2 over the lines of a band, every line alike
/// (Nevaranta 2016, Pub. VI, eq. 28), begun at the reference parameters as in the source.
[[nodiscard]] data::TwoMassParameters fitted_two_mass(const data::FrequencyResponse& response,
                                                      double sample_time_s,
                                                      const data::TwoMassParameters& start, ModelKind kind,
                                                      double low_hz, double high_hz);

/// Sampled response of such parameters.
[[nodiscard]] data::FrequencyResponse model_response(const data::TwoMassParameters& parameters,
                                                     double sample_time_s,
                                                     std::span<const double> frequencies_hz);

}  // namespace resonid::reproduction::vi
