// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/base/expected.hpp>
#include <resonid/data/detail/output_hold.hpp>
#include <resonid/data/record.hpp>
#include <resonid/fit/detail/controller_estimate.hpp>
#include <resonid/identification/options.hpp>
#include <resonid/online/lines/detail/sweep.hpp>

namespace resonid::identification::detail {

/// What will be done with a record, every choice made.
struct Plan {
  ExcitationType excitation = ExcitationType::other;
  Method method = Method::welch;  ///< Never automatic; for Method::model, how the response is measured first.
  Approach approach = Approach::direct;
  std::size_t period_samples = 0;         ///< 0: not periodic.
  std::size_t realisations = 0;           ///< With that period and phases of their own; 0: fewer than two.
  std::size_t transient_periods = 0;      ///< At the start, left out of the averages.
  std::size_t segment_samples = 0;        ///< Of averaged spectra; 0: by what the record shows.
  std::optional<online::SweepLaw> sweep;  ///< Of a chirp that is known.
  double low_hz = 0.0;
  double high_hz = 0.0;
  data::OutputHold hold;        ///< Of the measured output; responses are without it, loops with it.
  std::vector<double> grid_hz;  ///< Frequencies to report; empty: those of the method.
  /// Identified controller, with which the model is simulated in its loop; absent: by the recorded input.
  std::optional<fit::ControllerEstimate> loop_controller;
};

/// Refused: options that contradict one another or the record, and a method that lacks what it needs.
[[nodiscard]] expected<Plan, Error> make_plan(const data::Record& record, const Options& options);

/// Period of the excitation: as told, else as found; 0: none, nor of ExcitationType::other.
[[nodiscard]] std::size_t period_of(const data::Record& record, const Options& options);

/// The record cut into realisations of a random-phase excitation; empty when there are fewer than two.
[[nodiscard]] std::vector<data::Record> realisations_in(const data::Record& record,
                                                        std::size_t period_samples);

}  // namespace resonid::identification::detail
