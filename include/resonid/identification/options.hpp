// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <resonid/base/approach.hpp>
#include <resonid/base/enum_names.hpp>
#include <resonid/data/controller.hpp>
#include <resonid/online/lines/detail/sweep.hpp>
#include <string_view>
#include <utility>
#include <vector>

namespace resonid::identification {

using resonid::name_of;

enum class ExcitationType { automatic, chirp, multisine, prbs, stepped_sine, other };
inline constexpr EnumName<ExcitationType> kExcitationTypeNames[] = {
    {ExcitationType::automatic, "auto"},
    {ExcitationType::chirp, "chirp"},
    {ExcitationType::multisine, "multisine"},
    {ExcitationType::prbs, "prbs"},
    {ExcitationType::stepped_sine, "stepped-sine"},
    {ExcitationType::other, "other"}};
[[nodiscard]] constexpr std::span<const EnumName<ExcitationType>> enum_names(ExcitationType) noexcept {
  return kExcitationTypeNames;
}

/// How the response is measured; `model` reports the fitted model's response instead.
enum class Method {
  automatic,
  kalman,
  sliding_dft,
  welch,
  periodic,
  local_polynomial,
  local_cubic,
  least_squares,
  model,
  local_rational,
  simulate_and_correct,
  best_linear
};
inline constexpr EnumName<Method> kMethodNames[] = {{Method::automatic, "auto"},
                                                    {Method::kalman, "kalman"},
                                                    {Method::sliding_dft, "sliding-dft"},
                                                    {Method::welch, "welch"},
                                                    {Method::periodic, "periodic"},
                                                    {Method::local_polynomial, "local-polynomial"},
                                                    {Method::local_cubic, "local-cubic"},
                                                    {Method::least_squares, "least-squares"},
                                                    {Method::model, "model"},
                                                    {Method::local_rational, "local-rational"},
                                                    {Method::simulate_and_correct, "simulate-and-correct"},
                                                    {Method::best_linear, "best-linear"}};
[[nodiscard]] constexpr std::span<const EnumName<Method>> enum_names(Method) noexcept { return kMethodNames; }

/// black_box: a rational model of any order, for what no drive structure describes.
enum class ModelChoice { automatic, none, rigid, two_mass, three_mass, black_box };
inline constexpr EnumName<ModelChoice> kModelChoiceNames[] = {
    {ModelChoice::automatic, "auto"},        {ModelChoice::none, "none"},
    {ModelChoice::rigid, "rigid"},           {ModelChoice::two_mass, "two-mass"},
    {ModelChoice::three_mass, "three-mass"}, {ModelChoice::black_box, "black-box"}};
[[nodiscard]] constexpr std::span<const EnumName<ModelChoice>> enum_names(ModelChoice) noexcept {
  return kModelChoiceNames;
}

/// What is estimated of friction on the driven side. automatic: what the record shows.
enum class Friction { automatic, none, viscous, dry, both };
inline constexpr EnumName<Friction> kFrictionNames[] = {{Friction::automatic, "auto"},
                                                        {Friction::none, "none"},
                                                        {Friction::viscous, "viscous"},
                                                        {Friction::dry, "dry"},
                                                        {Friction::both, "both"}};
[[nodiscard]] constexpr std::span<const EnumName<Friction>> enum_names(Friction) noexcept {
  return kFrictionNames;
}

/// Springs to the ground, as of a stage on flexures. automatic: what the record shows.
enum class Ground { automatic, none, motor, load };
inline constexpr EnumName<Ground> kGroundNames[] = {
    {Ground::automatic, "auto"}, {Ground::none, "none"}, {Ground::motor, "motor"}, {Ground::load, "load"}};
[[nodiscard]] constexpr std::span<const EnumName<Ground>> enum_names(Ground) noexcept { return kGroundNames; }

/// How the kalman method tracks.
struct Tracker {
  std::optional<double> lambda;       ///< Fixed gain of the published filter; absent: placed poles.
  std::optional<double> pole_radius;  ///< 0 ... 1; absent: chosen from line spacing or sweep rate.
  bool offset = true;                 ///< One shared constant state (operating point).
  bool smoothing = true;              ///< Off line: no lag. Off: the published one-pass filter.
};

/// What the user knows and wants. The defaults choose everything from the record.
struct Options {
  ExcitationType excitation_type = ExcitationType::automatic;
  /// Linear, from the record's first sample on; the end may be the lower frequency.
  std::optional<online::SweepLaw> chirp = {};
  std::vector<double> lines_hz = {};  ///< Frequencies to report, ascending; empty: chosen.
  std::size_t period_samples = 0;     ///< Period of a periodic excitation; 0: detected.
  /// Periods discarded at the start of the record; best_linear: of each realisation, one at least.
  std::size_t drop_periods = 0;
  Method method = Method::automatic;
  std::optional<Approach> approach = {};            ///< Absent: joint with an excitation signal, else direct.
  std::optional<data::Controller> controller = {};  ///< C, from velocity error to torque.
  /// A controller that is to run: its margins are shown beside those of the one that ran.
  std::optional<data::Controller> planned_controller = {};
  double delay_s = 0.0;  ///< Known delay in the measured output.
  std::optional<std::pair<double, double>> band_hz = {};
  ModelChoice model = ModelChoice::automatic;
  /// Friction of drive models; dry friction needs a fit to the record.
  Friction friction = Friction::automatic;
  Ground ground = Ground::automatic;  ///< Side of drive models that a spring ties to the ground.
  /// Time constant of the torque loop, of first order; 0: it has none. Absent: estimated where the record
  /// shows it.
  std::optional<double> torque_lag_s = {};
  /// Time constant of the drive's filter of the measured velocity, of first order; otherwise as torque_lag_s.
  std::optional<double> output_filter_s = {};
  std::size_t order = 0;      ///< Order of the black-box model, 1 ... 20; 0: chosen by hold-out data.
  std::size_t bootstrap = 0;  ///< Replicas of a parametric bootstrap; 0: error bars by covariance only.
  std::uint64_t seed = 1;     ///< Seed of the bootstrap.
  std::size_t jobs = 1;      ///< Threads of the bootstrap; 0: one per core. The result does not depend on it.
  double confidence = 0.95;  ///< Confidence of the regions in report and summary, inside (0, 1).
  Tracker tracker = {};
  /// Radius of the driven roller: stiffness and damping are reported at the belt too.
  std::optional<double> radius_m = {};
  std::function<void(std::string_view)> progress = {};  ///< Called with the name of each stage that begins.
};

}  // namespace resonid::identification
