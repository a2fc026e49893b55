// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/identify.hpp>
#include <resonid/online/lines/detail/sweep.hpp>
#include <resonid/response/best_linear_approximation.hpp>
#include <resonid/response/line_estimates.hpp>

namespace resonid::identification::detail {

/// What will be done with a record, every choice made.
struct Plan {
  ExcitationType excitation = ExcitationType::other;
  Method method = Method::welch;  ///< Never automatic; for Method::model, how the response is measured first.
  Approach approach = Approach::direct;
  std::size_t period_samples = 0;         ///< 0: not periodic.
  std::size_t realisations = 0;           ///< With that period and phases of their own; 0: fewer than two.
  std::size_t transient_periods = 0;      ///< At the start, left out of the averages.
  std::optional<online::SweepLaw> sweep;  ///< Of a chirp that is known.
  double low_hz = 0.0;
  double high_hz = 0.0;
  std::vector<double> grid_hz;  ///< Frequencies to report; empty: those of the method.
  /// The record's own, with which the model is simulated in its loop; absent: by the recorded input.
  std::optional<data::TransferFunction> loop_controller;
};

[[nodiscard]] expected<Plan, Error> make_plan(const data::Record& record, const Options& options);

[[nodiscard]] std::string name_of(Method method);
[[nodiscard]] std::string name_of(Approach approach);

/// Period of the excitation: as told, else as found; 0: none.
[[nodiscard]] std::size_t period_of(const data::Record& record, const Options& options);

/// The record cut into realisations of a random-phase excitation; empty when there are fewer than two.
[[nodiscard]] std::vector<data::Record> realisations_in(const data::Record& record,
                                                        std::size_t period_samples);

/// Whether a method may come to average over realisations: best_linear, or one that is chosen by the record.
[[nodiscard]] constexpr bool averages_realisations(Method method) noexcept {
  return method == Method::best_linear || method == Method::automatic || method == Method::model ||
         method == Method::simulate_and_correct;
}

/// Ru, U and Y at the lines.
struct Measured {
  response::LineEstimates lines;
  std::optional<response::BestLinearApproximation> best_linear;  ///< Of Method::best_linear.
};

/// By the plan's method.
[[nodiscard]] expected<Measured, Error> measure(const data::Record& record, const Plan& plan,
                                                const Options& options);

}  // namespace resonid::identification::detail
