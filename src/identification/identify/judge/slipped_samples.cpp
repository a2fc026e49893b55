// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/criteria.hpp>
#include <identification/identify/judge/slipped_samples.hpp>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/diagnostics/residuals.hpp>
#include <resonid/fit/detail/noise_model.hpp>
#include <vector>

namespace resonid::identification::detail {
namespace {

/// What a share of the samples explains that follow another law than the noise.
struct Mixture {
  double share = 0.0;
  double gain = 0.0;  ///< In log-likelihood.
};

/// `ratio`: log-likelihood ratio of each sample.
Mixture fitted(const std::vector<double>& ratio) {
  constexpr double kFirst = 0.01, kMost = 50.0;
  constexpr int kRounds = 40;
  std::vector<double> odds;
  for (const double r : ratio) odds.push_back(std::exp(std::min(r, kMost)));
  const auto n = static_cast<double>(std::max<std::size_t>(1, ratio.size()));
  Mixture m{kFirst, 0.0};
  for (int round = 0; round < kRounds; ++round) {
    double sum = 0.0;
    for (const double o : odds) sum += m.share * o / (1.0 - m.share + m.share * o);
    m.share = sum / n;
  }
  for (const double o : odds) m.gain += std::log(1.0 - m.share + m.share * o);
  return m;
}

/// What samples of any other size explain, as where the model is wrong at times.
double gain_of_outliers(const std::vector<double>& white, double deviation) {
  double most = 0.0;
  for (const double wider : {1.5, 3.0, 6.0, 12.0}) {  // standard deviations
    const double variance = 1.0 + wider * wider;
    std::vector<double> ratio;
    for (const double e : white)
      ratio.push_back(0.5 * std::pow(e / deviation, 2) * (1.0 - 1.0 / variance) - 0.5 * std::log(variance));
    most = std::max(most, fitted(ratio).gain);
  }
  return most;
}

}  // namespace

std::optional<diagnostics::Finding> inspect_slips(std::span<const double> output,
                                                  const fit::OutputErrorFit& fit) {
  const auto white = fit::whiten(fit.residual, fit.noise);
  const auto simulated = diagnostics::simulated_of(output, fit.residual);
  std::vector<double> sizes;
  for (const double e : white) sizes.push_back(std::abs(e));
  constexpr double kGaussian = 0.6745;  // median of |e| over the standard deviation
  const double deviation = median(sizes) / kGaussian;
  const std::size_t before = fit.residual.size() - white.size();
  if (fit.fit_percent < kCriteria.poor_fit || !(deviation > 0.0) || simulated.size() != fit.residual.size())
    return std::nullopt;
  std::vector<double> dropped, repeated;
  for (std::size_t k = before > 0 ? 0 : 1; k < white.size(); ++k) {
    const double e = white[k] / deviation;
    const double step = (simulated[before + k] - simulated[before + k - 1]) / deviation;
    dropped.push_back(e * step - 0.5 * step * step);
    repeated.push_back(-e * step - 0.5 * step * step);
  }
  const Mixture ahead = fitted(dropped), behind = fitted(repeated);
  const bool drops = ahead.gain > behind.gain;
  const Mixture& best = drops ? ahead : behind;
  const Mixture& other = drops ? behind : ahead;
  const double count = best.share * static_cast<double>(white.size());
  if (best.gain < kCriteria.slipped_gain || best.gain < kCriteria.slipped_one_way * other.gain ||
      best.gain < gain_of_outliers(white, deviation) || best.share < kCriteria.outlier_share ||
      count < static_cast<double>(kCriteria.fewest_outliers))
    return std::nullopt;
  return diagnostics::Finding{
      drops ? "dropped-samples" : "repeated-samples", diagnostics::Severity::error, best.share,
      kCriteria.outlier_share,
      fmt::format("About {:.2g} % of the samples {} though the times do not tell: the output is {} its "
                  "simulation by one step there. Frequencies and inertias come out wrong; record without "
                  "losses, or with the times at which the samples were taken.",
                  100.0 * best.share, drops ? "are missing," : "stand twice,",
                  drops ? "ahead of" : "behind")};
}

}  // namespace resonid::identification::detail
