// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <optional>
#include <resonid/base/approach.hpp>
#include <resonid/base/enum_names.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/online/excitation/detail/guarded_excitation_config.hpp>
#include <resonid/online/lines/detail/dft_window.hpp>
#include <resonid/online/lines/detail/sweep.hpp>
#include <resonid/online/models/detail/physical_config.hpp>
#include <resonid/online/models/detail/rls_config.hpp>
#include <resonid/online/supervision/detail/change_config.hpp>
#include <span>
#include <string_view>

namespace resonid::online {

/// Which estimator follows the machine.
enum class AxisMethod {
  arx,                     ///< Recursive least squares: direct, biased by noise.
  output_error,            ///< RPLR: direct.
  prediction_error,        ///< RPEM, poles drawn in: direct.
  closed_loop,             ///< CLOE: indirect.
  filtered_closed_loop,    ///< F-CLOE, filter of the start model: indirect.
  damped_closed_loop,      ///< CLOE with a filter that follows the model, poles drawn in: indirect.
  instrumental_variables,  ///< Refined closed-loop instrumental variables: joint.
  physical,                ///< Extended Kalman filter of J1, J2, K, D.
  lines,                   ///< Kalman bank of fixed lines, with a rational fit.
  sliding_dft,             ///< Sliding DFT of fixed lines, with a rational fit.
  chirp,                   ///< The line of a chirp, with a rational fit of what it passed.
};
inline constexpr EnumName<AxisMethod> kAxisMethodNames[] = {{AxisMethod::arx, "arx"},
                                                            {AxisMethod::output_error, "oe"},
                                                            {AxisMethod::prediction_error, "rpem"},
                                                            {AxisMethod::closed_loop, "cloe"},
                                                            {AxisMethod::filtered_closed_loop, "f-cloe"},
                                                            {AxisMethod::damped_closed_loop, "d-cloe"},
                                                            {AxisMethod::instrumental_variables, "iv"},
                                                            {AxisMethod::physical, "physical"},
                                                            {AxisMethod::lines, "kalman"},
                                                            {AxisMethod::sliding_dft, "sliding-dft"},
                                                            {AxisMethod::chirp, "chirp"}};
[[nodiscard]] constexpr std::span<const EnumName<AxisMethod>> enum_names(AxisMethod) noexcept {
  return kAxisMethodNames;
}

/// What `AxisSample::output` is. Plant and parameters are always those of the velocity.
enum class AxisOutput { velocity, position, acceleration };

/// Where the loop L comes from, whose margins the rows hold.
enum class AxisLoop {
  none,
  controller,           ///< L = C Gd with the controller told, Gd of the model that fits, else at the lines.
  controller_at_lines,  ///< The same at the lines, whatever fits them. Of methods with lines.
  measured,             ///< L = Ru/U - 1 at the lines: whatever acts on the velocity is in it. `lines` and
                        ///< `sliding_dft`.
};

/// A controller u = C (r - y) + ru in powers of z^-1, in a fixed room.
struct AxisController {
  static constexpr std::size_t kMost = 32;  ///< Coefficients of each.

  std::array<double, kMost> numerator{}, denominator{};
  std::size_t numerator_size = 0, denominator_size = 0;
  bool of_position = false;  ///< C acts on the position, the integral of the output: L = C Gd/(jw).

  /// Both empty: none.
  static expected<AxisController, Error> create(std::span<const double> numerator,
                                                std::span<const double> denominator,
                                                bool of_position = false);
  [[nodiscard]] bool known() const noexcept { return numerator_size > 0; }
  /// From velocity to torque, at a frequency.
  [[nodiscard]] std::complex<double> response(double frequency_hz, double sample_rate_hz) const noexcept;
};

/// Thresholds of what a row is judged by.
struct AxisCriteria {
  double weak_excitation = 0.1;    ///< Rms in the band over the strongest so far; below: no excitation.
  double restless = 0.1;           ///< Relative distance of the resonance from its mean over a stretch.
  double residual_growth = 3.0;    ///< Rms of the residual over a stretch against its usual one.
  double resonance_std = 0.02;     ///< Largest relative standard deviation of the resonance.
  double antiresonance_std = 0.0;  ///< The same of the anti-resonance; 0: not asked for.
  double gain_std = 0.1;           ///< The same of b_1 of a rigid machine, which has no resonance.
  double line_std = 0.2;           ///< The same of the lines (median), where no model fits them.
  double missing = 0.05;           ///< Share of the newest samples (over `memory`) that may be missing.
  bool inside_lines = false;       ///< Resonance and anti-resonance must lie between first and last line.
};

/// What an axis injects when it is started, and within which limits.
struct AxisInjection {
  enum class Kind {
    multisine,  ///< At the axis' lines, Schroeder's phases.
    chirp,      ///< From the first line to the last one (or along the axis' chirp), again and again.
    prbs,       ///< PRBS of 13 cells, flat up to the last line.
    given,      ///< What excite() is handed.
  };
  Kind kind = Kind::multisine;
  double sweep_s = 5.0;  ///< One sweep of the chirp, > 0.
  /// `amplitude` is the excitation's peak value; `sample_rate_hz` is the axis', whatever stands here.
  GuardedExcitationConfig guard{};
};

/// A figure that is watched for a lasting change.
enum class AxisFigure { resonance, antiresonance, crossover, phase_margin, modulus_margin, gap };
inline constexpr EnumName<AxisFigure> kAxisFigureNames[] = {
    {AxisFigure::resonance, "resonance"},           {AxisFigure::antiresonance, "antiresonance"},
    {AxisFigure::crossover, "crossover"},           {AxisFigure::phase_margin, "phase-margin"},
    {AxisFigure::modulus_margin, "modulus-margin"}, {AxisFigure::gap, "gap"}};
[[nodiscard]] constexpr std::span<const EnumName<AxisFigure>> enum_names(AxisFigure) noexcept {
  return kAxisFigureNames;
}

/// Everything an axis is told. Spans are read by create() only.
struct AxisConfig {
  double sample_rate_hz = 0.0;  ///< Rate at which step() is called, > 0.
  AxisMethod method = AxisMethod::lines;
  AxisOutput output = AxisOutput::velocity;
  Approach approach = Approach::joint;  ///< For `lines`, `sliding_dft` and `chirp`; the others have one.
  double known_delay_s = 0.0;  ///< In the measured output, >= 0: taken out of the plant, in the margins.
  /// C in powers of z^-1, up to order 31 (CLOE 4, IV 6, of position 31); empty: not known.
  std::span<const double> controller_numerator{}, controller_denominator{};
  bool controller_of_position = false;
  AxisLoop loop = AxisLoop::controller;  ///< Without a controller: none.

  // What is followed.
  std::span<const double> lines_hz{};  ///< Ascending; of `lines` and `sliding_dft`, and of the multisine.
  SweepLaw sweep{};                    ///< Sweep of `chirp`; whatever the method, where a chirp is injected.
  std::size_t window_samples = 0;      ///< Window of `sliding_dft`; 0: `memory_s`.
  DftWindow window = DftWindow::rectangular;
  bool signal_offset = true;  ///< `lines`, `chirp`: a state for the constant part of the signals.
  std::optional<double> lambda{}, pole_radius{};  ///< `lines`, `chirp`: instead of `memory_s`.
  /// `lines`: narrow-band averages in place of the newest phasors, for an excitation that is not at every
  /// line all the time. Memory in trackers' memories; 0: none. start() chooses for its own excitation.
  double averaged_memories = 0.0;

  // How fast the estimate forgets.
  double memory_s = 0.0;  ///< 0: chosen by each method. Not for `physical`.
  /// `arx`, `output_error` ... `damped_closed_loop`: which forgetting, and how certain the start is.
  /// `factor` follows from `memory_s`; `start`, `scale` and `fixed` must be empty.
  RecursiveLeastSquaresConfig adaptation{.start_variance = 0.01};
  bool extrapolate = false;  ///< `instrumental_variables`: 2 theta(memory) - theta(2 memory), without lag.
  double start_deviation = 0.1;  ///< `instrumental_variables`: of each parameter over its size.
  double high_pass_hz = 0.0;  ///< `arx` ... `damped_closed_loop`: takes offsets out of all signals; 0: none.

  // Where it begins, and what else acts on the machine.
  /// Discrete model without the known delay: b_1 ..., a_1 ..., order 1 (rigid) or 3 (two masses); of all
  /// methods of discrete models. An integrator at z = 1 is kept.
  std::span<const double> start_b{}, start_a{};
  bool load_torque = true;           ///< `arx`, `output_error`, `prediction_error`, `instrumental_variables`.
  bool coulomb_friction = false;     ///< `arx`, `instrumental_variables`; `physical`: its own configuration.
  PhysicalTrackerConfig physical{};  ///< Settings of `physical`; sample rate and delay are the axis'.

  // What a row holds.
  std::size_t row_every_samples = 1;  ///< Samples from row to row, >= 1.
  /// Samples over which the work of a row is spread, 1 ... row_every_samples. 1: all of it at the row's own
  /// sample. More: a row comes that much later, and `lines` takes one line at a time.
  std::size_t spread_samples = 1;
  double loop_from_hz =
      0.0;  ///< Lower end of the band in which margins are looked for; 0: 0.0005 of the rate.
  /// What the gap is to: a model (without delay), or a response at ascending frequencies. Empty: no gap.
  std::span<const double> baseline_b{}, baseline_a{};  ///< b_1 ..., a_1 ...; up to order 7.
  std::span<const double> baseline_hz{};
  std::span<const std::complex<double>> baseline_response{};  ///< [line], without the known delay.
  std::optional<AxisFigure> change_of{};                      ///< A figure to be watched.
  ChangeDetectorConfig change{};                              ///< `sample_rate_hz` is that of the rows.
  AxisCriteria criteria{};
  double centre_hz = 0.0;  ///< About which excitation is looked for; 0: from the start, else from the lines.
  bool has_excitation = true;  ///< The samples hold ru; otherwise excitation is judged by the torque.
  bool injects = false;        ///< start() will be called: what it needs is made by create().
};

}  // namespace resonid::online
