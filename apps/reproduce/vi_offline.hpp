// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <resonid/base/approach.hpp>
#include <resonid/data/frequency_response.hpp>
#include <resonid/data/record.hpp>
#include <resonid/data/two_mass.hpp>
#include <string>
#include <utility>

#include "reproduce/vi_experiment.hpp"

namespace resonid::reproduction::vi {

/// Off-line response by averaged spectra: Hann segments of 4096 samples, half overlapping (Welch 1967).
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

/// The lines that eq. (28) is fitted to here.
inline constexpr double kFitLow_hz = 2.0;
inline constexpr double kFitHigh_hz = 40.0;

/// The parameters as the source's tables list them, at the belt, with the undamped frequencies.
inline constexpr double kRollerRadius_m = 0.05;
inline constexpr std::size_t kBeltQuantities = 6;
inline constexpr std::array<std::pair<const char*, const char*>, kBeltQuantities> kBeltNames{
    {{"K", "N/m"},
     {"D", "Ns/m"},
     {"J of the driven side", "kgm2"},
     {"J of the load", "kgm2"},
     {"f_res", "Hz"},
     {"f_ares", "Hz"}}};
using BeltValues = std::array<double, kBeltQuantities>;
[[nodiscard]] BeltValues belt_values(const data::TwoMassParameters& at_driven_shaft);

/// "+1.23 %"
[[nodiscard]] std::string percent(double value, double truth);

/// Sampled response of such parameters.
[[nodiscard]] data::FrequencyResponse model_response(const data::TwoMassParameters& parameters,
                                                     double sample_time_s,
                                                     std::span<const double> frequencies_hz);

}  // namespace resonid::reproduction::vi
