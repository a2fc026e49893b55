// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <resonid/planning/detail/fisher_information.hpp>
#include <resonid/planning/detail/power_distribution.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace resonid::planning {

/// What the drive stands, as deviations from the operating point. Infinite: no limit.
struct Limits {
  double torque = std::numeric_limits<double>::infinity();      ///< Peak of what the machine gets.
  double excitation = std::numeric_limits<double>::infinity();  ///< Peak of what is added to the controller.
  double torque_rms = std::numeric_limits<double>::infinity();  ///< Rms of that torque over the experiment.
  double velocity = std::numeric_limits<double>::infinity();    ///< Peak.
  double stroke = std::numeric_limits<double>::infinity();      ///< Largest less smallest position.
  double time_s = std::numeric_limits<double>::infinity();      ///< Whole experiment.
};

/// Longest experiment that is looked at where no time is given.
inline constexpr double kMostTime_s = 600.0;
/// And the most samples of any.
inline constexpr double kMostSamples = 2e6;

/// A figure that is wanted to a certain accuracy, one standard deviation.
struct AccuracyTarget {
  std::string figure;      ///< One of figure_names().
  double accuracy = 0.01;  ///< > 0, in parts of the figure's value if `relative`, else in its unit.
  bool relative = true;
};

enum class ExcitationType { multisine, chirp, prbs };
inline constexpr EnumName<ExcitationType> kExcitationTypeNames[] = {{ExcitationType::multisine, "multisine"},
                                                                    {ExcitationType::chirp, "chirp"},
                                                                    {ExcitationType::prbs, "prbs"}};
[[nodiscard]] constexpr std::span<const EnumName<ExcitationType>> enum_names(ExcitationType) noexcept {
  return kExcitationTypeNames;
}

struct PlanConfig {
  NominalDrive drive;
  Limits limits;
  std::vector<AccuracyTarget>
      targets;  ///< Empty: `accuracy_of_all` of all estimated inertias, stiffnesses and dampings.
  double accuracy_of_all = 0.01;  ///< > 0, relative.
  Criterion criterion = Criterion::accuracy;
  std::optional<ExcitationType> type;  ///< Absent: the one that needs the least time.
  double spread = 0.2;  ///< Part by which the nominal model's parameters may be wrong, 0 ... 0.5.
  /// Band that may be excited; absent: what the possible drives make sensible. Given, it binds: lines and
  /// sweeps lie in it, and of a PRBS 90 % of the power lie below its upper end and 80 % above its lower one.
  std::optional<std::pair<double, double>> band_hz;
  std::optional<double> period_s;                  ///< Period of the multisine; absent: chosen.
  std::uint64_t seed = 1;                          ///< Seed of the phases' random starts.
  std::function<void(std::string_view)> progress;  ///< Called with the name of each stage that begins.
};

/// Largest values that an experiment reaches in simulation, over all drives that are possible.
struct PeakValues {
  double excitation = 0.0;  ///< Peak of ru.
  double torque = 0.0, torque_rms = 0.0, velocity = 0.0, stroke = 0.0;
};

/// One way to excite the drive within the limits, and what it will tell.
struct Experiment {
  ExcitationType type = ExcitationType::multisine;
  double amplitude = 0.0;          ///< Peak of chirp and PRBS; of the multisine that of its samples.
  std::vector<double> excitation;  ///< [sample] ru over the whole experiment.
  double duration_s = 0.0;
  double crest_factor = 0.0;
  PeakValues peaks;
  std::string binding;           ///< Limit that keeps the amplitude down: "torque", "velocity" ...
  std::vector<Figure> figures;   ///< All of figure_names(), with predicted error bars.
  std::vector<Figure> targeted;  ///< In the order of the targets; those expected over the possible drives.
  double ratio = 0.0;            ///< Largest of deviation / wanted deviation: at most 1 when reached.
  /// Time after which all targets would be met with the same amplitude; absent where that is out of sight.
  std::optional<double> needed_s;
  /// Factor on the amplitude with which all targets would be met in the same time; absent: none up to 1e6.
  /// Filled in for the planned one.
  std::optional<double> needed_amplitude;
  bool noise_dominates = false;   ///< Fed-back noise tells more than the excitation; of the planned one.
  std::optional<double> least_s;  ///< Least time of its kind that was laid out and meets all targets.

  // Multisine only.
  std::vector<double> frequency_hz, line_amplitude, phase_rad;  ///< [line]
  std::size_t period_samples = 0, periods = 0, settle_periods = 0;
  // Chirp only.
  double from_hz = 0.0, to_hz = 0.0;
  // PRBS only.
  std::size_t register_length = 0, clock_divider = 1;
  double power_below_band = 0.0, power_above_band = 0.0;  ///< Parts of the power of a long one.
};

/// Two planned runs, the second laid out with the model that the first one gives.
struct TwoStagePlan {
  double first_s = 0.0;  ///< Time limit of the first run, planned with the same options.
  double spread = 0.0;  ///< Spread that the second plan assumes: two error bars of the worst known parameter.
  double second_s = 0.0;  ///< Predicted length of the second, mean over the possible drives.
  double one_s = 0.0;     ///< What one run takes, or would take, to the same accuracies.

  [[nodiscard]] double total_s() const { return first_s + second_s; }
};

/// A kind of excitation that was not laid out.
struct SkippedKind {
  ExcitationType type = ExcitationType::prbs;
  std::string reason;  ///< One sentence, without its full stop.
};

struct Plan {
  PlanConfig config;                    ///< With targets, band and period filled in.
  std::vector<Experiment> experiments;  ///< The planned one, then the others at its length, for comparison.
  std::vector<SkippedKind> skipped;     ///< Kinds that could not be compared.
  bool band_given = false;              ///< The band of the configuration binds.
  bool reached = false;                 ///< All targets within the limits.
  std::vector<double> grid_hz, grid_power;  ///< Design of the multisine, before its weak lines are dropped.
  double design_gap = 0.0;                  ///< See PowerDistribution.
  std::size_t drives = 1;                   ///< Possible drives that were averaged over.
  std::optional<TwoStagePlan> two_stages;   ///< Where they take clearly less time.
  double noise_torque = 0.0;  ///< Standard deviation of the torque that the controller makes of noise.

  [[nodiscard]] const Experiment& planned() const { return experiments.front(); }
};

/// The excitation that reaches the targeted accuracies in the least time within the limits.
///
/// 1. the power of a multisine's lines is distributed (distribute_power) so that all targets are met at once
/// as
///    early as possible, on average over the drives that the nominal model may stand for;
/// 2. its phases are chosen for small peaks of excitation, torque and velocity at once (optimise_phases);
/// 3. it is scaled until the simulated run from rest uses up the first limit, for every possible drive;
/// 4. the least whole number of periods is counted, by the Fisher information of the whole simulated record
///    (predicted); chirp and PRBS are laid out in the same way, unless a PRBS does not fit a given band.
///
/// Where `spread` is 0.1 or more and a multisine is planned, two steps are looked at: a first run of a fifth
/// of the time, then one planned for a spread of two of the error bars that the first leaves. Its length is
/// that of each possible drive's own best run, averaged, longer by what that spread costs the nominal drive.
/// Two runs are proposed when they take at most 0.8 of the time.
///
/// Targets that cannot be met in the time allowed leave `reached` false: then the plan is the best of that
/// time. Limits: linear drive, deviations without noise's own share of torque and velocity; the error bars
/// hold for a fit by output error of the whole record with the model's structure.
[[nodiscard]] expected<Plan, Error> make_plan(const PlanConfig& config);

}  // namespace resonid::planning
