// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace resonid::diagnostics {

/// Whether a residual depends on a signal that the model should have used up, beyond what chance and the
/// model's own uncertainty explain.
struct ResidualDependence {
  std::string on;            ///< "input", "excitation"; empty: not tested.
  std::size_t lags = 0;      ///< 1 ... lags of the signal.
  double probability = 1.0;  ///< Probability of so strong a dependence by chance.
  /// Part of the whitened residual's power that the lags explain beyond chance, 0 ... 1.
  double share = 0.0;
};

/// How the residual moves with each independent standard deviation of the model's parameters.
struct ModelUncertainty {
  Eigen::MatrixXd moved = {};  ///< [sample x direction], may be empty.
  /// The model was fitted to this record: then its parameters have used up what lies along these directions,
  /// which are taken out of signal and residual alike.
  bool fitted_here = false;
};

/// Whitens the residual by an autoregressive model A of itself, regresses it on the past of a signal,
/// A e(k) = sum_t g_t x(k-t) + white, t = 1 ... lags, and tests g = 0. So colour is no evidence, and neither
/// is feedback: x(k-t) holds past noise only; and the ringing of what the model misses needs no lags of its
/// own. With P the `uncertainty`, Cov(e) = noise + P P^T, and a residual that these explain is no evidence
/// either.
///
///   T = s^T (I + K K^T)^-1 s / sigma^2,   s, K: residual and P in an orthonormal basis of the lags
///
/// against chi-square with Bartlett's correction for the estimated sigma. Probability 1 where fewer than four
/// samples per lag are left. Source: Ljung 1999, 16.6 (model error model), in the form of a Wald test.
[[nodiscard]] ResidualDependence residual_dependence(std::span<const double> residual,
                                                     std::span<const double> signal, std::size_t lags,
                                                     const ModelUncertainty& uncertainty = {});

/// A narrow band of a signal.
struct LineOfSignal {
  double frequency_hz = 0.0;
  double half_width = 0.0;  ///< In Hz.
  double sample_rate_hz = 0.0;
  /// In a closed loop the input's future holds this sample's noise; an excitation does not.
  bool past_alone = false;
};

/// Probability that by chance the residual depends so strongly on a narrow band of a signal, of any phase:
/// the same test with two columns, the band and itself a quarter of a period later.
[[nodiscard]] double dependence_at(std::span<const double> residual, std::span<const double> signal,
                                   const LineOfSignal& line, const ModelUncertainty& uncertainty = {});

/// What disturbs the model's input as a function of the instantaneous value of a signal: friction over the
/// velocity, a dead zone or saturation over the input.
struct StaticMap {
  std::string over;           ///< "velocity", "input"; empty: not tested.
  std::vector<double> level;  ///< [bin] Mean of the signal there, ascending.
  std::vector<double> mean;   ///< [bin] In the unit of the input, beyond a straight line over the bins.
  std::vector<double> std;    ///< [bin]
  double probability = 1.0;   ///< Probability of so large values by chance.
  double share = 0.0;  ///< Part of the whitened residual's power that they explain beyond chance, 0 ... 1.
};

/// The signals of one simulation, sample by sample.
struct StaticMapSignals {
  std::span<const double> residual;
  std::span<const double> input;
  std::span<const double> simulated;
  std::span<const double> over;  ///< What the map is taken over.
  /// [bin][sample] Output of the model for an input that is 1 where `bins` puts `over` into this bin, else 0.
  std::span<const std::vector<double>> answers;
  /// Lag from which on the input acts. A nearer one explains nothing, and in a closed loop holds the noise of
  /// the residual's own sample: with a smooth excitation the residual would follow from the input exactly.
  std::size_t first_lag = 0;
};

/// Bin of every sample: at most `most` bins with equally many samples each, fewer where the signal has fewer
/// levels.
[[nodiscard]] std::vector<std::size_t> bins_of(std::span<const double> over, std::size_t most);

/// e(k) = sum_b c_b [G 1_b](k) + linear in lags first_lag ... `lags` of the input and 0 ... `lags` of the
/// simulated output + v(k), whitened
/// as above, c orthogonal to 1 and to the levels: what linear dynamics can explain is left to them. Tests
/// c = 0. Empty with fewer than three bins, or fewer than four samples per unknown.
[[nodiscard]] StaticMap static_map(const StaticMapSignals& signals, std::span<const std::size_t> bins,
                                   std::size_t lags);

}  // namespace resonid::diagnostics
