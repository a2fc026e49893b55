// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace resonid::diagnostics {

/// Correlation of a residual with a signal, or with itself:
///
///   RN(t) = sum e(k) x(k-t) / sqrt(sum e^2 sum x^2),   t = -M ... M, means removed
struct ResidualCorrelation {
  std::vector<double> value;  ///< [lag + M]; empty when the signal is not there.
  double largest = 0.0;       ///< Magnitude over the judged lags.
  int largest_lag = 0;        ///< Where that is.
  std::size_t beyond = 0;     ///< Judged lags beyond the limit of 3 %.
  /// Factor by which the limit is wider when residual and signal are both coloured (Bartlett): then
  /// neighbouring samples do not count as independent. 1 for a white residual.
  double colour = 1.0;
};

/// What a residual still holds (Nevaranta 2016, section 3.6.1). Lags 1 ... judged_lags are judged, those that
/// a model of na poles, nb zeros and d samples of delay must explain: max(na, nb + d). Negative lags are
/// shown only: in closed loop the noise acts on later inputs through the controller, and that rejects
/// nothing.
struct ResidualTest {
  std::size_t samples = 0;
  std::size_t max_lag = 0;      ///< M
  std::size_t judged_lags = 0;  ///< From lag 1 on.
  double mean = 0.0;            ///< Mean of the residual.
  double rms = 0.0;             ///< Rms of the residual, mean removed.
  double snr_db = 0.0;          ///< Simulated output over residual, in power.
  /// 2.17/sqrt(N): exceeded by 3 % of the lags of a residual that is independent of the signal. Where the
  /// signal-to-noise ratio is high even the true model fails it, by what it leaves unsaid (a stiffness that
  /// moves, friction): to be read with snr_db, never the only ground of a verdict.
  double limit = 0.0;
  ResidualCorrelation self;            ///< With itself; 1 at lag 0.
  ResidualCorrelation with_simulated;  ///< With the simulated output: for output-error structures.
  ResidualCorrelation with_input;
  ResidualCorrelation with_excitation;
};

/// The source's practical limit of a correlation (Nevaranta 2016, Pub. II and III).
inline constexpr double kPracticalCorrelation = 0.15;

/// Signals of the same samples; those that are not there are empty.
struct ResidualSignals {
  std::span<const double> residual;  ///< Output minus simulated output.
  std::span<const double> simulated;
  std::span<const double> input;
  std::span<const double> excitation;
};

/// [sample of the residual] The simulated output y - e; residual and output end with the same sample.
[[nodiscard]] std::vector<double> simulated_of(std::span<const double> output,
                                               std::span<const double> residual);

[[nodiscard]] ResidualTest test_residual(const ResidualSignals& signals, std::size_t max_lag,
                                         std::size_t judged_lags);

}  // namespace resonid::diagnostics
