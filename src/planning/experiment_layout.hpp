// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/planning/plan.hpp>

// What all kinds of excitation share: scaling to the limits and counting the time.
namespace resonid::planning::detail {

/// The problem as the layouts see it: drives, gradients of the targeted figures over their wanted deviations.
struct Task {
  explicit Task(const PlanConfig& config);

  const PlanConfig& config;
  double sample_rate_hz = 0.0;
  std::vector<NominalDrive> drives;      ///< The nominal one first.
  std::vector<std::string> names;        ///< Of the targeted figures.
  std::vector<double> wanted;            ///< [target] deviations, of the nominal drive.
  std::vector<Eigen::MatrixXd> targets;  ///< [drive]: [target, parameter]
  std::vector<Eigen::MatrixXd> noise;    ///< [drive]: fisher_information_of_noise().
  double low_hz = 0.0, high_hz = 0.0;    ///< Where the drive tells most, or the band that was given.
  bool band_given = false;
  std::size_t most_samples = 0;  ///< Of an experiment; kMostTime_s where no time is given.
};

/// Largest values over all possible drives.
[[nodiscard]] PeakValues peaks_of(const Task& task, std::span<const double> excitation);

/// Largest use of a limit, and its name: above 1 it is exceeded.
[[nodiscard]] std::pair<double, std::string> most_used(const Limits& limits, const PeakValues& peaks);

/// Scales the excitation so that the first limit is used up.
void scale_to_limits(const Task& task, Experiment& experiment);

/// Fills in figures, targeted, ratio and needed_s of an experiment whose excitation is complete.
void evaluate(const Task& task, Experiment& experiment);

/// Fills in needed_amplitude and noise_dominates of an evaluated experiment.
void evaluate_amplitude(const Task& task, Experiment& experiment);

[[nodiscard]] Experiment lay_out_chirp(const Task& task, std::size_t samples);
[[nodiscard]] Experiment lay_out_prbs(const Task& task, std::size_t samples);

/// Why no PRBS does within a band that was asked for; absent where one does.
[[nodiscard]] std::optional<std::string> prbs_outside_band(const Task& task);

/// make_plan() without a look at two steps.
[[nodiscard]] expected<Plan, Error> plan_once(const PlanConfig& config);

/// A short run and a second one planned with its model, where that takes clearly less time than `plan`, which
/// was made for `config`.
[[nodiscard]] std::optional<TwoStagePlan> two_stages(const PlanConfig& config, const Plan& plan);

/// The multisine of the least time, or of `samples` at most; the design goes to `plan`.
[[nodiscard]] expected<Experiment, Error> plan_multisine(const Task& task, Plan& plan);

}  // namespace resonid::planning::detail
