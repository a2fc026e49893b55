// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <resonid/base/enum_names.hpp>
#include <resonid/online/excitation/guarded_excitation.hpp>
#include <resonid/online/supervision/detail/change_config.hpp>
#include <span>
#include <string_view>

namespace resonid::online {

/// One sample of an axis, as it was. Not finite: missing.
template <class Real>
struct AxisSample {
  Real excitation{};  ///< ru; 0 where there is none. What excite() returned, where the axis injects itself.
  Real torque{};      ///< u, the total command as the drive got it, ru included.
  Real output{};      ///< What was measured (AxisOutput).
};

/// A value with its standard deviation. Not a number: not known.
struct Figure {
  double value = std::numeric_limits<double>::quiet_NaN();
  double std = std::numeric_limits<double>::quiet_NaN();
};

/// What a row has to pass before it is trusted (docs/methods/axis.md).
struct AxisGates {
  bool ready = false;      ///< The start no longer matters.
  bool excited = false;    ///< Rms of the excitation in the band against the strongest so far.
  bool converged = false;  ///< Resonance known, and at rest over the last stretch.
  bool physical = false;   ///< Signs and stability.
  bool residual = false;   ///< The residual is as strong as it was.
  bool complete = false;   ///< Not too many samples are missing.
  bool covered = false;  ///< Resonance and anti-resonance lie between the lines (AxisCriteria::inside_lines).
  [[nodiscard]] bool all() const noexcept {
    return ready && excited && converged && physical && residual && complete && covered;
  }
};

/// Why a row is not trusted: the first gate that is closed.
enum class AxisVerdict {
  trusted,
  not_measured,  ///< No row yet.
  not_ready,
  stopped,  ///< A limit ended the injection.
  samples_missing,
  not_excited,
  unphysical,
  outside_lines,
  not_converged,
  residual_grown,
};
inline constexpr EnumName<AxisVerdict> kAxisVerdictNames[] = {
    {AxisVerdict::trusted, "trusted"},
    {AxisVerdict::not_measured, "not-measured"},
    {AxisVerdict::not_ready, "not-ready"},
    {AxisVerdict::stopped, "stopped"},
    {AxisVerdict::samples_missing, "samples-missing"},
    {AxisVerdict::not_excited, "not-excited"},
    {AxisVerdict::unphysical, "unphysical"},
    {AxisVerdict::outside_lines, "outside-lines"},
    {AxisVerdict::not_converged, "not-converged"},
    {AxisVerdict::residual_grown, "residual-grown"}};
[[nodiscard]] constexpr std::span<const EnumName<AxisVerdict>> enum_names(AxisVerdict) noexcept {
  return kAxisVerdictNames;
}

inline constexpr std::size_t kAxisParameters = 8;  ///< Most of any method.

/// What is known at one instant.
struct AxisRow {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

  std::uint64_t sample = 0;  ///< Index of the newest sample in it, 0 for the first.
  double lag_samples = 0.0;  ///< It describes the machine of so many samples before that.
  std::array<Figure, kAxisParameters> parameter{};  ///< b, a or physical ones: BasicAxis::parameter_name().
  Figure resonance_hz, antiresonance_hz;            ///< Undamped.
  double resonance_damping = kUnknown, antiresonance_damping = kUnknown;
  double driven_inertia = kUnknown, load_inertia = kUnknown,
         stiffness = kUnknown;  ///< Parameters of a two-mass machine.

  Figure crossover_hz;      ///< First downward crossing of |L| = 1.
  Figure phase_margin_deg;  ///< There.
  Figure modulus_margin;    ///< min |1 + L|
  Figure gap;               ///< Largest chordal distance to the baseline, 0 ... 1.
  double worst_phase_margin_deg = kUnknown, modulus_margin_hz = kUnknown;
  double gain_margin_db = kUnknown, gain_margin_hz = kUnknown;
  double coherence = kUnknown;  ///< Mean over the lines.

  double residual_rms = kUnknown;  ///< Over the last stretch, in the output's unit.
  double uncertainty = kUnknown;   ///< Relative, of what `converged` asks for.
  double most_uncertainty = kUnknown;
  bool controller_differs = false;  ///< Excitation, torque and output do not show the controller told.
  /// Largest difference of those lines that differ, over the controller told; 0: none differs.
  double controller_difference = kUnknown;

  AxisGates gates;
  AxisVerdict verdict = AxisVerdict::not_measured;
  bool trusted = false;
};

/// Rows so far, each from the first one that was ready.
struct AxisCounts {
  std::uint64_t rows = 0;                                                ///< All.
  std::uint64_t ready = 0;                                               ///< From the first ready one on.
  std::uint64_t lost = 0;                                                ///< Excited, but not ready again.
  std::uint64_t excited = 0, converged = 0, physical = 0, residual = 0;  ///< The last three: excited, too.
  std::uint64_t all = 0;
};

/// Local stability of a pseudo-linear recursion, looked at every 250 samples.
struct AxisStability {
  std::uint64_t watched = 0, unstable = 0;
  double least_eigenvalue = std::numeric_limits<double>::infinity();
  std::uint64_t restarts = 0;  ///< Predictions that were lost.
};

/// What an axis says.
struct AxisResult {
  AxisRow row;  ///< The newest one.
  AxisCounts counts;
  AxisStability stability;
  double weakest_excitation = 1.0;  ///< Rms over the strongest, least of the judged rows.
  double worst_residual_growth = 0.0;
  double residual_correlation = 0.0;  ///< Correlation of neighbouring residuals; 0 for white ones.
  bool changed = false;               ///< The watched figure.
  Change change{};
  bool injecting = false;  ///< Ramping in, steady or ramping out.
  bool settled = false;    ///< Rows are made. Without an own injection: always.
  StopReason stop_reason = StopReason::none;
  std::uint64_t samples = 0, skipped_samples = 0;
};

/// The plant's response at one line.
struct AxisLine {
  double frequency_hz = 0.0;  ///< Frequency of the line; of a chirp, that which the value belongs to.
  std::complex<double> response{AxisRow::kUnknown,
                                AxisRow::kUnknown};  ///< For velocity, known delay removed.
  double std = AxisRow::kUnknown;                    ///< std^2 = E|error|^2
  bool settled = false;
};

}  // namespace resonid::online
